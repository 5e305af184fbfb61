#!/usr/bin/python3
"""Draws the errors that `scripts/check_sequences.py --json RESULTS.json` found beside those of the public system.

Example: scripts/check_sequences.py --json results.json; scripts/plot_accuracy.py results.json -o docs/benchmarks/accuracy.png
"""

import argparse
import pathlib

from matplotlib.ticker import LogLocator, NullFormatter

from check_sequences import DATA, SETS, geometric_mean, public_error
from plotting import COLORS, plt, read_table, save

ORDER = ("track_", "scan_", "hard_", "ablate_")
OURS, PUBLIC = COLORS["normalflow"], COLORS["icp"]


def draw(axis, names, ours, public, label):
    rows = range(len(names))
    axis.hlines(rows, ours, public, color="lightgray", zorder=1)
    axis.scatter(public, rows, color=PUBLIC, marker="s", label="public system", zorder=2)
    axis.scatter(ours, rows, color=OURS, label="this program", zorder=3)
    axis.set_yticks(rows, names)
    axis.set_ylim(len(names) - 0.5, -0.5)
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter(lambda value, _: "%g" % value)
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.set_xlabel(label)
    axis.grid(axis="x", which="both", alpha=0.25)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=pathlib.Path, help="file that check_sequences.py --json wrote")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("accuracy.png"))
    arguments = parser.parse_args()
    reference = {}
    for name in SETS:
        reference.update(read_table(DATA / name / "reference.json", "nothing: set GELSLAM_DATA"))
    results = {n: r for n, r in read_table(arguments.results, "scripts/check_sequences.py --json").items() if isinstance(r, dict)}
    names = [n for start in ORDER for n in sorted(results) if n.startswith(start) and reference[n]]
    meshes = [n for n in names if results[n]["mesh"] and reference[n]["mesh"]]
    heights = [len(names), max(1, len(meshes))]
    figure, axes = plt.subplots(2, 1, figsize=(8, 1.6 + 0.25 * sum(heights)), height_ratios=heights)
    draw(axes[0], names, [geometric_mean(results[n]["trajectory"]["mae"]) for n in names],
         [public_error(reference[n]) for n in names], "trajectory: geometric mean of the six axis errors (mm)")
    draw(axes[1], meshes, [results[n]["mesh"]["known_pose"]["accuracy"]["mean_mm"] for n in meshes],
         [reference[n]["mesh"]["acc_mean_mm"] for n in meshes], "mesh: mean distance to the true surface (mm)")
    axes[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncol=2, frameon=False)
    save(figure, arguments.output)


if __name__ == "__main__":
    main()
