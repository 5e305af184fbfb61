#!/usr/bin/python3
"""Makes docs/images/scan.webp: the live window while a simulated object is scanned.

Simulates the scan, replays it in the live program on a display of its own (Xvfb), takes a picture of the window in even
steps, and turns the finished surface around. Run it on an idle computer: the replay is in real time, and drawing without a
graphics card takes most of a core. Needs python3-pil, xvfb.
"""
import argparse
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[1]
RATE_HZ = 25  # of the simulated sensor
SIZE = (800, 500)  # of the animation; the window is drawn larger
SCAN_MS, STEP_MS, LAST_MS = 8000, 100, 1500  # the scan, a step of the turn after it, the end
TURN = 18  # steps of it


def options():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/bin/gelslam")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "docs/images/scan.webp")
    parser.add_argument("--object", default="pebble")
    parser.add_argument("--frames", type=int, default=1500, help="of the simulated scan")
    parser.add_argument("--log", type=pathlib.Path, help="a scan that was simulated before")
    parser.add_argument("--pictures", type=int, default=80, help="of the scan at most, before those of the finished surface")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the single pictures")
    return parser.parse_args()


def script_of(pictures, wait_s, folder):
    """For the window: docs/viewer.md."""
    lines = ["resize 1000 625", "until tracking", "key t"]
    for k in range(pictures):
        lines += [f"screenshot {folder}/{k:03}.png", f"wait {wait_s:.3f}"]
    lines += ["until finished 600", "key t", "key tab", "key r", "wait 1.5"]
    for k in range(pictures, pictures + TURN):
        lines += [f"screenshot {folder}/{k:03}.png", "drag 8 0", "wait 0.1"]
    return "\n".join([*lines, "quit"]) + "\n"


def take_pictures(arguments, work):
    """The names of those of the scan, and of those of the finished surface."""
    log = arguments.log or work / "log"
    if not arguments.log:
        subprocess.run([arguments.program, "simulate", "scan", "--object", arguments.object, "--motion", "allover", "--frames",
                        str(arguments.frames), "--indentation", "0.6", "-o", log], check=True)
    seconds = len(np.load(log / "true_start_T_currs.npy")) / RATE_HZ
    # A picture takes time, too.
    (work / "script").write_text(script_of(arguments.pictures, 0.85 * seconds / arguments.pictures, work))
    subprocess.run(["xvfb-run", "-a", "-s", "-screen 0 1280x800x24", arguments.program, "replay", log, "-o", work / "run",
                    "--script", work / "script"], check=True)
    names = sorted(work.glob("[0-9][0-9][0-9].png"))
    end_s = names[0].stat().st_mtime + seconds - 1  # a slow computer takes some of the first ones after the scan
    return [name for name in names[:-TURN] if name.stat().st_mtime < end_s], names[-TURN:]


def main():
    arguments = options()
    with tempfile.TemporaryDirectory() as work:
        scan, turn = take_pictures(arguments, pathlib.Path(work))
        names = scan + turn
        if arguments.keep:
            arguments.keep.mkdir(parents=True, exist_ok=True)
            for name in names:
                shutil.copy(name, arguments.keep)
        pictures = [Image.open(name).convert("RGB").resize(SIZE, Image.LANCZOS) for name in names]
    durations = [SCAN_MS // len(scan)] * len(scan) + [STEP_MS] * (TURN - 1) + [LAST_MS]
    pictures[0].save(arguments.output, save_all=True, append_images=pictures[1:], duration=durations, loop=0, quality=80, method=6)
    print(f"{arguments.output}: {len(scan)} + {TURN} pictures, {sum(durations) / 1000:.1f} s, {arguments.output.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
