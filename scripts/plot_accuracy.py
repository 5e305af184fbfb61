#!/usr/bin/python3
"""Draws the errors that `scripts/check_sequences.py --json RESULTS.json` found beside those of the public system.

Example: scripts/check_sequences.py --json results.json; scripts/plot_accuracy.py results.json -o docs/benchmarks/accuracy.png
"""

import pathlib

from check_sequences import DATA, SETS, geometric_mean, public_error
from plotting import OURS, PUBLIC, logarithmic, plt, read_table, save, study_arguments

ORDER = ("track_", "scan_", "hard_", "ablate_")


def draw(plot, pairs, label):
    rows, (ours, public) = range(len(pairs)), zip(*pairs.values()) if pairs else ((), ())
    plot.hlines(rows, ours, public, color="lightgray", zorder=1)
    plot.scatter(public, rows, color=PUBLIC, marker="s", label="public system", zorder=2)
    plot.scatter(ours, rows, color=OURS, label="this program", zorder=3)
    plot.set_yticks(rows, pairs)
    plot.set(ylim=(len(pairs) - 0.5, -0.5), xlabel=label)
    logarithmic(plot, "x")


def main():
    arguments = study_arguments(__doc__, "check_sequences.py --json", pathlib.Path("accuracy.png"))
    reference = {}
    for name in SETS:
        reference.update(read_table(DATA / name / "reference.json", "nothing: set GELSLAM_DATA"))
    results = {n: r for n, r in read_table(arguments.study, "scripts/check_sequences.py --json").items() if isinstance(r, dict)}
    names = [n for start in ORDER for n in sorted(results) if n.startswith(start) and reference[n]]
    poses = {n: (geometric_mean(results[n]["trajectory"]["mae"]), public_error(reference[n])) for n in names}
    meshes = {n: (results[n]["mesh"]["known_pose"]["accuracy"]["mean_mm"], reference[n]["mesh"]["acc_mean_mm"])
              for n in names if results[n]["mesh"] and reference[n]["mesh"]}
    heights = [len(poses), max(1, len(meshes))]
    figure, plots = plt.subplots(2, 1, figsize=(8, 1.6 + 0.25 * sum(heights)), height_ratios=heights)
    draw(plots[0], poses, "trajectory: geometric mean of the six axis errors (mm)")
    draw(plots[1], meshes, "mesh: mean distance to the true surface (mm)")
    plots[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncol=2, frameon=False)
    save(figure, arguments.output)


if __name__ == "__main__":
    main()
