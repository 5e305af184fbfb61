#!/usr/bin/python3
"""Makes docs/images/scan.webp: the live window while a simulated object is scanned.

Simulates the scan, replays it in the live program, takes a picture of the screen in even steps, and turns the finished
surface around. Run it on an idle computer, on a display of its own: the replay is in real time, and drawing without a
graphics card takes most of a core. Needs python3-pil, xvfb:

    xvfb-run -a -s "-screen 0 1280x800x24" scripts/scan_animation.py
"""
import argparse
import pathlib
import signal
import subprocess
import tempfile
import time

import numpy as np
from PIL import Image, ImageGrab

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
    parser.add_argument("--pictures", type=int, default=80, help="of the scan, before those of the finished surface")
    return parser.parse_args()


def pictures_of_scan(arguments, log, run):
    """The screen in even steps from the first touch to the last."""
    seconds = len(np.load(log / "true_start_T_currs.npy")) / RATE_HZ
    replay = subprocess.Popen([arguments.program, "replay", log, "-o", run])
    while not run.is_dir():
        time.sleep(0.1)
    start, pictures = time.monotonic() + 1, []
    for k in range(arguments.pictures):
        time.sleep(max(0, start + k * seconds / arguments.pictures - time.monotonic()))
        pictures.append(ImageGrab.grab())
    replay.send_signal(signal.SIGINT)  # once all is saved, the window closes
    replay.wait()
    return pictures


def pictures_of_turn(arguments, run, folder):
    pictures = []
    for k in range(TURN):
        name = folder / f"{k:02}.png"
        subprocess.run([arguments.program, "view", run, "--yaw", str(2 * k), "--snapshot", name, "-q"], check=True)
        pictures.append(Image.open(name))
    return pictures


def main():
    arguments = options()
    with tempfile.TemporaryDirectory() as work:
        log, run = arguments.log or pathlib.Path(work) / "log", pathlib.Path(work) / "run"
        if not arguments.log:
            subprocess.run([arguments.program, "simulate", "scan", "--object", arguments.object, "--motion", "allover", "--frames",
                            str(arguments.frames), "--indentation", "0.6", "-o", log], check=True)
        pictures = pictures_of_scan(arguments, log, run) + pictures_of_turn(arguments, run, pathlib.Path(work))
        pictures = [picture.convert("RGB").resize(SIZE, Image.LANCZOS) for picture in pictures]
    durations = [SCAN_MS // arguments.pictures] * arguments.pictures + [STEP_MS] * (TURN - 1) + [LAST_MS]
    pictures[0].save(arguments.output, save_all=True, append_images=pictures[1:], duration=durations, loop=0, quality=80, method=6)
    print(f"{arguments.output}: {len(pictures)} pictures, {sum(durations) / 1000:.1f} s, {arguments.output.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
