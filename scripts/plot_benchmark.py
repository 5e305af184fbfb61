#!/usr/bin/python3
"""Draws what `gelslam-lab benchmark -o BENCH` wrote: errors per object and axis.

Example: gelslam-lab benchmark data/TactileTracking -o BENCH && scripts/plot_benchmark.py BENCH
"""

import numpy as np

from plotting import NAMES, color, draw_study, plt, save

AXES = {"x_mm": "x (mm)", "y_mm": "y (mm)", "z_mm": "z (mm)",
        "rx_deg": "rotation about x (°)", "ry_deg": "rotation about y (°)", "rz_deg": "rotation about z (°)"}


def draw(rows, path):
    objects, methods = rows["object"].unique(), rows["method"].unique()
    figure, plots = plt.subplots(2, 3, figsize=(min(max(12.0, 0.3 * len(objects) * len(methods)), 20.0), 6.0))
    figure.suptitle("mean absolute error", fontsize=11)
    for plot, (axis, title) in zip(plots.ravel(), AXES.items()):
        errors = rows.pivot(index="object", columns="method", values=axis).loc[objects, methods]
        errors.plot.bar(ax=plot, width=0.8, color=list(map(color, methods)), legend=False)
        plot.set_xticklabels(objects, rotation=60, ha="right")
        decades = np.log10(rows[rows[axis] > 0][axis])
        plot.set(yscale="log", ylim=10.0 ** np.array((np.floor(decades.min()), np.ceil(decades.max() + 0.04))), title=title, xlabel="")
        plot.yaxis.set_major_formatter("{x:g}")
    # One legend for all plots, below them, where it hides nothing.
    figure.legend([NAMES.get(method, method) for method in methods], loc="lower center", ncol=len(methods))
    save(figure, path, (0, 0.05, 1, 1))


if __name__ == "__main__":
    draw_study(__doc__, "benchmark", "accuracy.json", draw)
