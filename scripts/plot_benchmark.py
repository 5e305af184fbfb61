#!/usr/bin/python3
"""Draws what `gelslam-lab benchmark -o BENCH` wrote: errors per object and axis.

Example: gelslam-lab benchmark data/TactileTracking -o BENCH && scripts/plot_benchmark.py BENCH
"""

import numpy as np

from plotting import NAMES, color, draw_study, in_order, plt, save

AXES = {"x_mm": "x (mm)", "y_mm": "y (mm)", "z_mm": "z (mm)",
        "rx_deg": "rotation about x (°)", "ry_deg": "rotation about y (°)", "rz_deg": "rotation about z (°)"}


def draw(rows, path):
    objects, methods = in_order(r["object"] for r in rows), in_order(r["method"] for r in rows)
    figure, plots = plt.subplots(2, 3, figsize=(min(max(12.0, 0.3 * len(objects) * len(methods)), 20.0), 6.0))
    figure.suptitle("mean absolute error", fontsize=11)
    width = 0.8 / len(methods)
    for plot, (axis, title) in zip(plots.ravel(), AXES.items()):
        for i, method in enumerate(methods):
            by_object = {r["object"]: r[axis] for r in rows if r["method"] == method}
            places = [objects.index(o) - 0.4 + (i + 0.5) * width for o in by_object]
            plot.bar(places, list(by_object.values()), width, color=color(method), label=NAMES.get(method, method))
        plot.set_xticks(range(len(objects)), objects, rotation=60, ha="right")
        decades = np.log10([r[axis] for r in rows if r[axis] > 0] or [1.0])
        plot.set(yscale="log", ylim=10.0 ** np.array((np.floor(decades.min()), np.ceil(decades.max() + 0.04))), title=title)
        plot.yaxis.set_major_formatter("{x:g}")
    # One legend for all plots, below them, where it hides nothing.
    figure.legend(*plots[0, 0].get_legend_handles_labels(), loc="lower center", ncol=len(methods))
    save(figure, path, (0, 0.05, 1, 1))


if __name__ == "__main__":
    draw_study(__doc__, "benchmark", "accuracy.json", draw)
