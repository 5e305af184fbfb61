#!/usr/bin/python3
"""Draws the errors that `scripts/check_sequences.py --json RESULTS.json` found beside those of the public system.

Example: scripts/check_sequences.py --json results.json; scripts/plot_accuracy.py results.json -o docs/benchmarks/accuracy.png
"""

import json
import pathlib

from check_sequences import references
from plotting import OURS, PUBLIC, logarithmic, plt, save, study_arguments

ORDER = ("track_", "scan_", "hard_", "ablate_")


def draw(plot, pairs, label):
    rows, (ours, public) = range(len(pairs)), zip(*pairs.values()) if pairs else ((), ())
    plot.hlines(rows, ours, public, color="lightgray", zorder=1)
    plot.scatter(public, rows, color=PUBLIC, marker="s", label="public system", zorder=2)
    plot.scatter(ours, rows, color=OURS, label="this program", zorder=3)
    plot.set_yticks(rows, pairs)
    plot.set(ylim=(len(pairs) - 0.5, -0.5), xlabel=label)
    logarithmic(plot, "x")


if __name__ == "__main__":
    arguments = study_arguments(__doc__, "check_sequences.py --json", pathlib.Path("accuracy.png"))
    reference, results = references(), json.loads(arguments.study.read_text())
    names = [n for start in ORDER for n in sorted(results) if n.startswith(start) and isinstance(results[n], dict) and reference[n]["error_mm"]]
    poses = {n: (results[n]["trajectory"]["geometric_mean_mm"], reference[n]["error_mm"]) for n in names}
    meshes = {n: (results[n]["mesh"]["known_pose"]["accuracy"]["mean_mm"], reference[n]["mesh"]["acc_mean_mm"])
              for n in names if results[n]["mesh"] and reference[n]["mesh"]}
    heights = [len(poses), max(1, len(meshes))]
    figure, plots = plt.subplots(2, 1, figsize=(8, 1.6 + 0.25 * sum(heights)), height_ratios=heights)
    draw(plots[0], poses, "trajectory: geometric mean of the six axis errors (mm)")
    draw(plots[1], meshes, "mesh: mean distance to the true surface (mm)")
    plots[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncol=2, frameon=False)
    save(figure, arguments.output)
