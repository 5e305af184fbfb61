#!/usr/bin/env python3
"""Compares two sensors that hold an object between them with one sensor and twice as many frames.

Simulates both (`gelslam simulate scan --rig`), reconstructs two logs into one map (`reconstruct A B --rig`, without being told
how the sensors are fixed) and one log alone, and prints per object, motion and seed the pose error of the first sensor
(geometric mean of six axes), the mesh's mean distance to the true surface (known start pose), and by how much the pose of the
second sensor in the first is wrong, with its standard deviation.

Example: scripts/rig_study.py --seeds 1 --cases golf
"""

import argparse
import json
import math
import pathlib
import subprocess

import numpy
from matplotlib import tri

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Object, size, motion, distance of the sensors: the object is pressed by about 0.5 mm from both sides.
CASES = {"golf": ("golf", 0.5, "allover", 20.35), "golf_roll": ("golf", 0.5, "roll", 20.35),
         "pebble": ("pebble", 1, "wobble", 13.0), "peanut": ("peanut", 1, "wobble", 12.2),
         "knurl": ("knurl", 1, "roll", 10.0), "rod": ("cylinder", 1, "wobble", 11.0),
         "blade": ("blade", 1, "wobble", 2.75)}
X_MM, Y_MM = 1.5, 0.8
# As above; pressed by 0.2 to 0.4 mm on either side. The largest coin hides nearly all bare gel.
THICK = (("coin", 0.7, "wobble", 1.8), ("coin", 0.8, "allover", 1.8), ("coin", 0.8, "slide", 1.8), ("coin", 0.8, "twist", 1.8),
         ("coin", 1, "allover", 1.8), ("blade", 1, "wobble", 2.75), ("blade", 1, "slide", 2.75))
THICK_INDENTATION_MM = 0.3
KNOWN = "sigma_mm: 0.01\nsigma_deg: 0.1\n"
RIG = """second_y: {x: 0, y: -1, z: 0}
second_z: {x: 0, y: 0, z: -1}
second_origin: {x: %g, y: %g, z: %g}
"""


def call(*command, codes=(0,)):
    done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode not in codes:
        raise SystemExit(done.stderr)
    return done.stdout


def read_vertices(file):
    """Positions in millimeters."""
    data = file.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode().splitlines()
    count = next(int(line.split()[2]) for line in header if line.startswith("element vertex"))
    names = [line.split()[2] for line in header if line.startswith("property float ")]
    return 1000 * numpy.frombuffer(data, "<f4", count * len(names), end).reshape(count, -1)[:, :3].astype(float)


def moved(points, pose):
    return points @ pose[:3, :3].T + 1000 * pose[:3, 3]


def thickness_error(run, truth, middle_mm):
    """Medians over both faces; the run's anchor is put where it truly was."""
    anchor = json.loads((run / "report.json").read_text())["anchor_frame"]
    meta = json.loads((truth / "meta.json").read_text())
    poses = numpy.load(truth / "true_start_T_currs.npy")
    found = moved(read_vertices(run / "mesh.ply"), poses[anchor - meta["background_frames"]])
    true = moved(read_vertices(truth / "gt_mesh.ply"), numpy.array(meta["start_T_object"]))
    offsets = []
    for is_back in (False, True):
        of_found, of_true = (points[(points[:, 2] > middle_mm) == is_back] for points in (found, true))
        height = tri.LinearTriInterpolator(tri.Triangulation(of_true[:, 0], of_true[:, 1]), of_true[:, 2])
        offsets.append(numpy.ma.median(of_found[:, 2] - height(of_found[:, 0], of_found[:, 1])))
    return offsets[1] - offsets[0]


def study_thickness(arguments):
    print("%-6s %-5s %-8s %4s   %s" % ("object", "size", "motion", "seed", "too thick by (mm)"))
    for name, size, motion, distance_mm in THICK:
        for seed in arguments.seeds:
            folder = arguments.out / ("%s_%g_%s_%d" % (name, size, motion, seed))
            folder.mkdir(parents=True, exist_ok=True)
            rig = folder / "rig.yaml"
            rig.write_text(RIG % (0, 0, distance_mm) + KNOWN)
            simulate(arguments, (name, size, motion), seed, folder / "two", arguments.frames, "--rig", rig,
                     "--indentation", THICK_INDENTATION_MM)
            call(arguments.program, "reconstruct", folder / "two/first", folder / "two/second", "--rig", rig, "-q",
                 "--overwrite", "-o", folder / "run_two", codes=(0, 1))
            error = thickness_error(folder / "run_two", folder / "two/first", distance_mm / 2)
            print("%-6s %-5g %-8s %4d   %.3f" % (name, size, motion, seed, error), flush=True)


def simulate(arguments, case, seed, folder, frames, *more):
    name, size, motion = case
    if not folder.exists():
        call(arguments.program, "simulate", "scan", "--object", name, "--size", size, "--motion", motion, "--frames", frames,
             "--seed", seed, "--calibration", arguments.calibration, "-o", folder, "-q", *more)


def evaluate(arguments, run, truth):
    found = json.loads(call(arguments.program, "evaluate", run, "--truth", truth, "--json", "-q"))
    return found["trajectory"]["geometric_mean_mm"], found["mesh"]["known_pose"]["accuracy"]["mean_mm"]


def rig_error(rig, distance_mm):
    """Largest error of the origin along an axis (mm), and angle (degrees), with the sigmas of both."""
    m = rig["first_T_second_mm"]
    off = max(abs(a - b) for a, b in zip((m[3], m[7], m[11]), (X_MM, Y_MM, distance_mm)))
    trace = m[0] - m[5] - m[10]
    return (off, max(rig["sigma_mm"]), math.degrees(math.acos(max(-1, min(1, (trace - 1) / 2)))), max(rig["sigma_deg"]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/bin/gelslam")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build/rig_study")
    parser.add_argument("--calibration", type=pathlib.Path, help="of the simulated sensors; else one is made")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    parser.add_argument("--frames", type=int, default=500, help="of each of two sensors")
    parser.add_argument("--thickness", action="store_true", help="of coins and a blade")
    arguments = parser.parse_args()
    if not arguments.calibration:
        arguments.calibration = arguments.out / "calibration"
        if not arguments.calibration.exists():
            call(arguments.program, "simulate", "calibration", "--optics", "flat",  # as in docs/results.md
                 "-o", arguments.calibration, "-q")
    if arguments.thickness:
        study_thickness(arguments)
        return
    print("%-10s %4s %22s %22s   %s" % ("case", "seed", "two: pose, mesh (mm)", "one: pose, mesh (mm)", "rig: error, sigma"))
    for case in arguments.cases:
        for seed in arguments.seeds:
            folder = arguments.out / ("%s_%d" % (case, seed))
            folder.mkdir(parents=True, exist_ok=True)
            rig = folder / "rig.yaml"
            rig.write_text(RIG % (X_MM, Y_MM, CASES[case][3]))
            simulate(arguments, CASES[case][:3], seed, folder / "two", arguments.frames, "--rig", rig)
            simulate(arguments, CASES[case][:3], seed, folder / "one", 2 * arguments.frames)
            call(arguments.program, "reconstruct", folder / "two/first", folder / "two/second", "--rig", "-q", "--overwrite",
                 "-o", folder / "run_two", codes=(0, 1))
            call(arguments.program, "reconstruct", folder / "one", "-q", "--overwrite", "-o", folder / "run_one")
            two = evaluate(arguments, folder / "run_two", folder / "two/first")
            one = evaluate(arguments, folder / "run_one", folder / "one")
            found = json.loads((folder / "run_two/report.json").read_text()).get("rig")
            words = "two maps"
            if found:
                words = "%.2f mm, %.2f; %.1f degrees, %.1f" % rig_error(found, CASES[case][3])
            print("%-10s %4d %11.4f %10.4f %11.4f %10.4f   %s" % (case, seed, *two, *one, words), flush=True)


if __name__ == "__main__":
    main()
