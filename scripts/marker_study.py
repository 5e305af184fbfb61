#!/usr/bin/env python3
"""Compares scans on a gel with printed dots with the same scans on the same gel without them.

Simulates a sensor, its calibration by ball presses and scans (`gelslam simulate scan --dots`), runs `gelslam reconstruct` and
`gelslam evaluate`, and prints per object and seed the mesh's mean distance to the true surface (placed by the known pose), its
completeness within 0.1 mm, the pose error (geometric mean of six axes) and the ratios with over without dots. A ratio of the
mesh error of 1.3 is the aim. Slopes and ball radii of real presses on such a gel: gelslam-lab calibration PRESSES --only ours.

Example: scripts/marker_study.py --objects pebble
"""

import argparse
import json
import math
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent


def call(*command):
    return subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout


def measure(arguments, name, seed, dots):
    folder = arguments.out / ("%s_%d%s" % (name, seed, "_dots" if dots else ""))
    result = folder / "result.json"
    if not result.exists():
        call(arguments.program, "simulate", "scan", "--object", name, "--motion", "allover", "--frames", arguments.frames,
             "--optics", "flat", "--seed", seed,  # as in docs/results.md
             "-o", folder, "--overwrite", "-q", *(["--dots=%g" % arguments.spacing] if dots else []))
        call(arguments.program, "reconstruct", folder, "-o", folder / "run", "-q", "--overwrite")
        result.write_bytes(call(arguments.program, "evaluate", folder / "run", "--truth", folder, "--json", "-q"))
    return json.loads(result.read_text())


def figures(found):
    mesh = found["mesh"]["known_pose"]
    within = next(w for w in mesh["within"] if abs(w["distance_mm"] - 0.1) < 1e-6)
    return mesh["accuracy"]["mean_mm"], within["completeness"], found["trajectory"]["geometric_mean_mm"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/bin/gelslam")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build/marker_study")
    parser.add_argument("--objects", nargs="+", default=["pebble", "peanut"])
    parser.add_argument("--seeds", nargs="+", type=int, default=list(range(1, 9)))
    parser.add_argument("--frames", type=int, default=600)
    parser.add_argument("--spacing", type=float, default=2.0, help="of the dots, mm")
    arguments = parser.parse_args()
    print("%-10s %4s %25s %25s   %s" % ("object", "seed", "mesh mm, complete, pose mm", "the same with dots", "mesh, pose ratio"))
    ratios = []
    for name in arguments.objects:
        for seed in arguments.seeds:
            plain, dotted = (figures(measure(arguments, name, seed, dots)) for dots in (False, True))
            ratios.append(dotted[0] / plain[0])
            print("%-10s %4d %11.4f %5.2f %7.4f %11.4f %5.2f %7.4f   %5.2f %5.2f" %
                  (name, seed, *plain, *dotted, ratios[-1], dotted[2] / plain[2]), flush=True)
    print("mesh ratio, geometric mean: %.2f" % math.exp(sum(map(math.log, ratios)) / len(ratios)))


if __name__ == "__main__":
    main()
