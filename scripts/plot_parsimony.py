#!/usr/bin/python3
"""Draws what gelslam-lab parsimony wrote: errors of trajectory and mesh against what is spent.

Example: gelslam-lab parsimony -o STUDY && scripts/plot_parsimony.py STUDY -o docs/benchmarks/parsimony.png
"""

from matplotlib.ticker import LogLocator, NullFormatter
from plotting import in_order, plt, read_table, save, study_arguments

# What is spent, its unit, and the knobs that spend it.
PANELS = (("keyframes", 1, "keyframes made", ("keyframe_min_shared",)),
          ("samples", 1, "samples per registration", ("max_samples",)),
          ("pixels", 1e-3, "pixels per frame through the gradient model (thousand)", ("gradient_everywhere",)),
          ("triangles", 1e-3, "triangles of the mesh (thousand)", ("voxel_size_mm",)),
          ("bytes", 1e-6, "the run's folder (MB)", ("keyframe_min_shared", "voxel_size_mm")))
ERRORS = (("error_mm", "trajectory: geometric mean of six axes (mm)"), ("mesh_mean_mm", "mesh: mean distance to the truth (mm)"))
COLORS = ("#1b6ca8", "#d1495b", "#2e933c", "#8d6a9f", "#edae49")


def draw_plot(plot, rows, sequences, spent, unit, knobs, error):
    for sequence, color in zip(sequences, COLORS):
        mine = [r for r in rows if r["sequence"] == sequence and r[error] != "null"]
        default = [r for r in mine if r["knob"] == "default"]
        for knob, line in zip(knobs, ("o-", "s--")):
            turned = sorted((float(r[spent]) * unit, float(r[error])) for r in mine if r["knob"] == knob or r in default)
            plot.plot(*zip(*turned) if turned else ([], []), line, color=color, markersize=4, linewidth=1.2)
        for r in default:
            plot.plot(float(r[spent]) * unit, float(r[error]), "*", color=color, markersize=12, markeredgecolor="black",
                      markeredgewidth=0.6, zorder=4)
    plot.set_xscale("log")
    plot.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    plot.xaxis.set_major_formatter("{x:g}")
    plot.xaxis.set_minor_formatter(NullFormatter())
    plot.set_ylim(bottom=0)
    plot.grid(True, which="both", alpha=0.2)
    plot.tick_params(labelsize=7)


def draw(rows, path):
    sequences = in_order(r["sequence"] for r in rows)
    errors = [e for e in ERRORS if any(r[e[0]] != "null" for r in rows)]
    figure, plots = plt.subplots(len(errors), len(PANELS), figsize=(3.3 * len(PANELS), 3.2 * len(errors) + 0.5), dpi=120, squeeze=False)
    for line, (error, label) in zip(plots, errors):
        line[0].set_ylabel(label, fontsize=8)
        for plot, (spent, unit, title, knobs) in zip(line, PANELS):
            if spent == "triangles" and error == "error_mm":
                plot.axis("off")  # the mesh is made when the poses are known
                continue
            draw_plot(plot, rows, sequences, spent, unit, knobs, error)
            plot.set_xlabel(title, fontsize=8)
    handles = [plt.Line2D([], [], color=c, marker="o", markersize=4, label=s) for s, c in zip(sequences, COLORS)]
    handles += [plt.Line2D([], [], color="dimgray", marker="*", linestyle="", markersize=11, label="default"),
                plt.Line2D([], [], color="dimgray", marker="o", markersize=4, label="bytes: keyframes more or fewer"),
                plt.Line2D([], [], color="dimgray", marker="s", linestyle="--", markersize=4, label="bytes: mesh finer or coarser")]
    figure.legend(handles=handles, fontsize=8, loc="lower center", ncol=len(handles))
    save(figure, path, (0, 0.05, 1, 1))


def main():
    arguments = study_arguments(__doc__, "parsimony")
    rows = read_table(arguments.study / "parsimony.csv", "gelslam-lab parsimony -o")
    draw(rows, arguments.output)


if __name__ == "__main__":
    main()
