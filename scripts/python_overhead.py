#!/usr/bin/python3
"""Processor time per frame of the Python module over that of the C++ program, on one log.

Usage: PYTHONPATH=build/python scripts/python_overhead.py LOG [--program build/bin/gelslam] [--model MODEL] [--rounds 3]

Both read the log, track, map, fuse and save. The time to start (libraries, interpreter) is measured and taken off. Of
several rounds, taken in turn, the quickest counts.
"""
import argparse
import os
import pathlib
import resource
import subprocess
import sys
import tempfile

FRAME_BY_FRAME = """
import itertools, sys, gelslam
log, model, run = sys.argv[1:]
frames = gelslam.Log(log)
bare = [image for image, _ in itertools.islice(frames, 10)]
slam = gelslam.Slam(gelslam.Sensor(model or None, background=bare))
for image, time_s in frames:
    frame = slam.process(image, time_s)
    pose, surface = frame.trial_T_sensor, frame.sigma_mm
slam.finish().save(run)
"""
WHOLE_LOG = """
import sys, gelslam
log, model, run = sys.argv[1:]
gelslam.reconstruct(log, model or None).save(run)
"""


def processor_s(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    root = pathlib.Path(__file__).resolve().parents[1]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log")
    parser.add_argument("--program", default=root / "build/bin/gelslam")
    parser.add_argument("--model", default="", help="default: the one that the log's configuration names")
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()

    import gelslam
    frames = sum(1 for _ in gelslam.Log(arguments.log))
    model = arguments.model or model_of(arguments.log)
    with tempfile.TemporaryDirectory() as folder:
        run = os.path.join(folder, "run")
        commands = {
            "program": ([arguments.program, "reconstruct", arguments.log, "--model", model, "-o", run, "-q"],
                        [arguments.program, "--version"]),
            "reconstruct()": ([sys.executable, "-c", WHOLE_LOG, arguments.log, model, run],
                              [sys.executable, "-c", "import gelslam"]),
            "Slam.process()": ([sys.executable, "-c", FRAME_BY_FRAME, arguments.log, model, run],
                               [sys.executable, "-c", "import gelslam"]),
        }
        best = {}
        for _ in range(arguments.rounds):
            for name, (work, start) in commands.items():
                subprocess.run(["rm", "-rf", run], check=True)
                seconds = processor_s(work) - min(processor_s(start) for _ in range(3))
                best[name] = min(best.get(name, seconds), seconds)
    for name, seconds in best.items():
        print(f"{name:15} {1000 * seconds / frames:6.2f} ms per frame   ratio {seconds / best['program']:.3f}")


def model_of(log):
    """The model that config.yaml in the log's folder names."""
    folder = pathlib.Path(log) if pathlib.Path(log).is_dir() else pathlib.Path(log).parent
    for line in (folder / "config.yaml").read_text().splitlines():
        if line.strip().startswith("calibration_model_path:"):
            return str(folder / line.split(":", 1)[1].strip().strip("\"'"))
    sys.exit("give --model")


if __name__ == "__main__":
    main()
