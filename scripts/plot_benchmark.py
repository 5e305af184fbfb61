#!/usr/bin/python3
"""Draws what `gelslam-lab benchmark -o BENCH` wrote: errors per object and axis.

Example: gelslam-lab benchmark data/TactileTracking -o BENCH && scripts/plot_benchmark.py BENCH
"""

import numpy as np

from plotting import NAMES, color, draw_study, in_order, plt, save

AXES = ("x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg")
TITLES = ("x (mm)", "y (mm)", "z (mm)", "rotation about x (°)", "rotation about y (°)", "rotation about z (°)")


def draw(rows, path):
    objects, methods = in_order(r["object"] for r in rows), in_order(r["method"] for r in rows)
    figure, plots = plt.subplots(2, 3, figsize=(min(max(12.0, 0.3 * len(objects) * len(methods)), 20.0), 6.0), dpi=120)
    figure.suptitle("mean absolute error", fontsize=11)
    width = 0.8 / len(methods)
    for plot, axis, title in zip(plots.ravel(), AXES, TITLES):
        for i, method in enumerate(methods):
            by_object = {r["object"]: r[axis] for r in rows if r["method"] == method}
            places = [objects.index(o) - 0.4 + (i + 0.5) * width for o in by_object]
            plot.bar(places, list(by_object.values()), width, color=color(method), label=method)
        plot.set_xticks(range(len(objects)), objects, rotation=60, ha="right", fontsize=7)
        values = [r[axis] for r in rows if r[axis] > 0] or [1.0]
        plot.set_yscale("log")
        plot.set_ylim(10.0 ** np.floor(np.log10(min(values))), 10.0 ** np.ceil(np.log10(1.1 * max(values))))  # whole decades
        plot.yaxis.set_major_formatter("{x:g}")
        plot.set_title(title, fontsize=9)
        plot.grid(True, axis="y", alpha=0.3)
    # One legend for all plots, below them, where it hides nothing.
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, [NAMES.get(label, label) for label in labels], fontsize=8, loc="lower center", ncol=len(labels))
    save(figure, path, (0, 0.05, 1, 1))


if __name__ == "__main__":
    draw_study(__doc__, "benchmark", "accuracy.json", draw)
