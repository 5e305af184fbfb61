#!/usr/bin/python3
"""How fast a motion may be: the share of right steps against speed, offline, live and of the public system.

Simulates textured objects that are rolled all over and slid to and fro at growing speeds (25 Hz), tracks each log with
`gelslam reconstruct`'s tracker and with `gelslam scan` at the log's own pace, and compares the motion between every two
frames with the truth. A step is right if both frames are tracked in one trial and it is within 0.1 mm and 1 degree of the
truth; what is lost or dropped is not right. --public DIR (see scripts/public_system.sh) tracks with the public
system, too, offline; its model is an nnmodel.pth of the simulated sensor. Prints a table, and writes speed_followed.csv and
speed_followed.png into DIR.

Example: scripts/speed_followed.py STUDY --program build/bin/gelslam
"""

import argparse
import json
import pathlib
import subprocess

import numpy as np
import pandas as pd

from plotting import plt, save

ROOT = pathlib.Path(__file__).resolve().parent.parent
RATE_HZ, BACKGROUND_FRAMES = 25, 10
RIGHT = 0.1, 1.0  # mm, degrees
MOTIONS = [(name, ("--object", name, "--size", "0.5", "--indentation", "0.8", "--motion", "allover", "--frames", str(frames)))
           for name in ("pebble", "peanut") for frames in (800, 400, 200, 100, 50)]
MOTIONS += [(name, ("--object", name, "--motion", "wobble", "--speed", str(speed), "--frames", "150"))
            for name in ("coin", "pebble") for speed in (1, 2.5, 5)]
BINS = {"mm/s": (0, 2, 5, 10, 20, 40, 80, np.inf), "degrees/s": (0, 10, 20, 40, 80, 160, 320, np.inf)}
STYLES = {"offline": "-o", "live": "--x", "public": ":s"}


def frames_of(words):
    """Tracked frames of a stream: trial and pose (mm) by index."""
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False)
    found = {}
    for line in map(json.loads, done.stdout.splitlines()):
        if line.get("type", "frame") == "frame" and line["status"] == "tracked":
            pose = np.reshape(line["pose"], (4, 4)).astype(float)
            pose[:3, 3] *= 1e3
            found[line["frame"] - BACKGROUND_FRAMES] = line["trial"], pose
    return found


def public_frames(public, model, log):
    """The same of the public system. Empty where it finds nothing."""
    subprocess.run([ROOT / "scripts/public_system.sh", public, log / "public", log, model], stdout=subprocess.DEVNULL, check=True)
    tracked = log / "public" / log.name / "track.tum"
    if not tracked.exists():
        return {}
    from still_moved import poses_of
    poses = poses_of(tracked, RATE_HZ)
    trials = np.loadtxt(tracked.with_name("track_groups.txt"), dtype=int, ndmin=2)
    return {frame - BACKGROUND_FRAMES: (trial, poses[frame]) for frame, trial in trials}


def size_of(motion):
    """mm and degrees."""
    return np.linalg.norm(motion[:3, 3]), np.degrees(np.arccos(np.clip((np.trace(motion[:3, :3]) - 1) / 2, -1, 1)))


def steps(truth, found):
    """Speed in mm/s and degrees/s, and whether it was followed, of every step in touch."""
    for i in range(len(truth) - 1):
        if np.isnan(truth[i:i + 2, 0, 0]).any():
            continue
        motion = np.linalg.inv(truth[i]) @ truth[i + 1]
        right = False
        if i in found and i + 1 in found and found[i][0] == found[i + 1][0]:
            right = np.less_equal(size_of(np.linalg.inv(motion) @ np.linalg.inv(found[i][1]) @ found[i + 1][1]), RIGHT).all()
        yield *(RATE_HZ * np.array(size_of(motion))), int(right)


def measure(program, folder, public, public_model):
    """A row for each step."""
    rows = []
    for k, (name, words) in enumerate(MOTIONS):
        log = folder / f"log_{k}"
        subprocess.run([program, "simulate", "scan", *words, "-q", "--overwrite", "-o", log], check=True)
        truth = np.load(log / "true_start_T_currs.npy")
        truth[:, :3, 3] *= 1e3
        found = {"offline": frames_of([program, "track", log, "--format", "ndjson"]),
                 "live": frames_of([program, "scan", log, "--headless", "-q", "--stream", "-"])}
        if public:
            found["public"] = public_frames(public, public_model, log)
        rows += [(name, schedule, *step) for schedule, frames in found.items() for step in steps(truth, frames)]
    return pd.DataFrame(rows, columns=["object", "schedule", *BINS, "right"])


def shares(table):
    """Steps and the share of right ones by schedule and speed, where there are enough."""
    for schedule, mine in table.groupby("schedule", sort=False):
        for unit, edges in BINS.items():
            for speed, right in mine.groupby(pd.cut(mine[unit], edges, right=False))["right"]:
                if len(right) >= 10:
                    yield {"schedule": schedule, "unit": unit, "low": speed.left, "high": speed.right, "steps": len(right), "share": right.mean()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=pathlib.Path, metavar="DIR", help="folder to write")
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/bin/gelslam")
    parser.add_argument("--public", type=pathlib.Path, metavar="DIR")
    parser.add_argument("--public-model", type=pathlib.Path, metavar="nnmodel.pth")
    arguments = parser.parse_args()
    arguments.study.mkdir(parents=True, exist_ok=True)
    study, program, *public = (path and path.resolve() for path in vars(arguments).values())
    table = measure(program, study, *public)
    table.to_csv(study / "speed_followed.csv", index=False)
    table = pd.DataFrame(shares(table))
    print(table.to_string(index=False, float_format="{:.3g}".format))
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True)
    for axis, (unit, of_unit) in zip(axes, table.groupby("unit", sort=False)):
        for schedule, mine in of_unit.groupby("schedule", sort=False):
            axis.plot(["< %g" % high if high < 1e9 else "more" for high in mine["high"]], mine["share"], STYLES[schedule], label=schedule)
        axis.set(xlabel=unit, ylim=(0, 1.02))
    axes[0].set_ylabel("share of right steps")
    axes[0].legend()
    save(figure, study / "speed_followed.png")


if __name__ == "__main__":
    main()
