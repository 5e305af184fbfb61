#!/usr/bin/env python3
"""Tracks the same motion in the middle of the gel, at its borders and in its corners, and compares the errors.

Simulates a sensor, its calibration by ball presses and scans (`gelslam simulate scan --place`), runs `gelslam track` and
prints one row per case: share of the touched frames that are tracked, mean error of the pose in its trial (geometric mean over
the six axes, a degree counted as 0.087 mm) and its ratio to the middle, the same ratio for the error at the middle of the
contact (the pose is that of the sensor's origin, where a tilt counts in z by its lever), and the root mean square of error
over stated standard deviation for each axis. A ratio of 1.5 and 0.7 to 1.4 are the aims. silent: as in scripts/silent_failures.py.

Example: scripts/border_study.py --cases narrow_right
"""

import argparse
import collections
import json
import math
import pathlib
import statistics
import subprocess
import sys

from check_sequences import AXES, geometric_mean
from silent_failures import between, count, errors, joined, read_poses

ROOT = pathlib.Path(__file__).resolve().parent.parent
HALF_MM = (10.1, 7.6)  # of the view
OBJECTS = {
    "pebble": ["--object", "pebble", "--speed", "0.4"],
    "narrow": ["--object", "screw", "--size", "0.35", "--speed", "0.4", "--indentation", "0.4"],
    "small": ["--object", "pebble", "--size", "0.3", "--speed", "0.4"],
}
PLACES = {  # as shares of the half view
    "middle": (0, 0), "left": (-0.78, 0), "right": (0.78, 0), "top": (0, -0.72), "bottom": (0, 0.72),
    "topleft": (-0.75, -0.68), "topright": (0.75, -0.68), "bottomleft": (-0.75, 0.68), "bottomright": (0.75, 0.68),
    "leaving": (1.08, 0),
}
Row = collections.namedtuple("Row", "share mean at_contact z silent")


def simulate(program, calibration, folder, options, place):
    if (folder / "meta.json").exists():
        return
    x, y = (share * half for share, half in zip(place, HALF_MM))
    command = [program, "simulate", "scan", *options, "--place=%.2f,%.2f" % (x, y), "--frames", "150", "-o", folder,
               "--calibration", calibration, "--overwrite", "-q"]
    subprocess.run([str(c) for c in command], check=True)


def at_contact(error, center_mm):
    """Errors of the pose, x y z in mm and rx ry rz in degrees, at a point of the sensor instead of its origin."""
    (rx, ry, rz), (x, y) = (math.radians(angle) for angle in error[3:]), center_mm
    return [error[0] - rz * y, error[1] + rz * x, error[2] + rx * y - ry * x] + error[3:]


def mean_error(frames):
    """Geometric mean over the axes of the mean absolute errors, in mm."""
    return geometric_mean({name: max(statistics.fmean(map(abs, axis)), 1e-9) for name, axis in zip(AXES, zip(*frames))})


def track(program, folder, extra):
    done = subprocess.run([str(program), "track", str(folder), "--format", "ndjson", *extra],
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False)
    lines = done.stdout.splitlines()
    truth = read_poses(folder / "true_start_T_currs.npy")
    first, all_errors, contact_errors, squares, touched = {}, [], [], [], sum(not math.isnan(t[0]) for t in truth)
    for line in lines:
        frame = json.loads(line)
        index = frame["frame"] - 10
        if frame["status"] != "tracked" or not 0 <= index < len(truth) or math.isnan(truth[index][0]):
            continue
        if frame["trial"] not in first:
            first[frame["trial"]] = (truth[index], frame["pose"])
            all_errors.append([0.0] * 6)
            contact_errors.append([0.0] * 6)
            continue
        true_first, estimated_first = first[frame["trial"]]
        error = errors(joined(*between(estimated_first, frame["pose"])), joined(*between(true_first, truth[index])))
        sigma = frame["sigma_mm"] + frame["sigma_deg"]
        all_errors.append(error)
        contact_errors.append(at_contact(error, frame["contact"]["center_mm"]))
        squares.append([(e / s) ** 2 if s else math.nan for e, s in zip(error, sigma)])
    if len(all_errors) < 2:
        return Row(len(all_errors) / max(1, touched), math.nan, math.nan, [math.nan] * 6, 0)
    z = [math.sqrt(statistics.fmean(axis)) for axis in zip(*squares)]
    return Row(len(all_errors) / max(1, touched), mean_error(all_errors), mean_error(contact_errors), z,
               count(lines, truth).silent)


def root_mean_squares(scores):
    tracked = [z for z in scores if not math.isnan(z[0])]
    return [math.sqrt(statistics.fmean(z * z for z in axis)) for axis in zip(*tracked)]


def z_text(z):
    return " ".join("%4.1f" % value for value in z)


def row_text(row):
    return "%6.2f %8.4f" % (row.share, row.mean), "%s   %6d" % (z_text(row.z), row.silent)


def print_folders(arguments):
    print("%-20s %6s %8s   %s   %s" % ("sequence", "share", "error", "error / sigma: x y z rx ry rz", "silent"))
    rows = []
    for folder in arguments.folders:
        rows.append(track(arguments.program, folder, arguments.extra))
        print("%-20s %s   %s" % (folder.name, *row_text(rows[-1])), flush=True)
    print("%-20s %15s   %s" % ("root mean square", "", z_text(root_mean_squares(r.z for r in rows))))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="*", default=[], help="OBJECT_PLACE names (default: all)")
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/bin/gelslam")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "runs/borders", help="simulated scans are kept there")
    parser.add_argument("--folders", nargs="*", type=pathlib.Path, default=[], help="data folders with truth instead")
    parser.add_argument("--extra", nargs="*", default=[], help="more arguments of gelslam track")
    arguments = parser.parse_args()
    if arguments.folders:
        print_folders(arguments)
        return 0
    calibration = arguments.out / "calibration"
    if not (calibration / "model/nnmodel.pth").exists():
        subprocess.run([str(arguments.program), "simulate", "calibration", "--optics", "flat",  # as in docs/results.md
                        "-o", str(calibration), "--overwrite", "-q"], check=True)
    print("%-20s %6s %8s %6s %10s   %s   %s" %
          ("case", "share", "error", "ratio", "at contact", "error / sigma: x y z rx ry rz", "silent"))
    ratios, contact_ratios, z_scores = [], [], []
    for name, options in OBJECTS.items():
        middle = None
        for place, share in PLACES.items():
            case = name + "_" + place
            if arguments.cases and place != "middle" and case not in arguments.cases:
                continue
            if arguments.cases and not any(c.startswith(name + "_") for c in arguments.cases):
                continue
            simulate(arguments.program, calibration, arguments.out / case, options, share)
            row = track(arguments.program, arguments.out / case, arguments.extra)
            middle = row if place == "middle" else middle
            ratios.append(row.mean / middle.mean)
            contact_ratios.append(row.at_contact / middle.at_contact)
            z_scores.append(row.z)
            print("%-20s %6.2f %8.4f %6.2f %10.2f   %s   %6d" %
                  (case, row.share, row.mean, ratios[-1], contact_ratios[-1], z_text(row.z), row.silent), flush=True)
    print("%-20s %33s   %s" % ("root mean square", "", z_text(root_mean_squares(z_scores))))
    for what, values in (("ratio", ratios), ("at the contact", contact_ratios)):
        values = [value for value in values if not math.isnan(value)]
        print("%s: median %.2f, worst %.2f" % (what, statistics.median(values), max(values)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
