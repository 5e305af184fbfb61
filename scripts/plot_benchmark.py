#!/usr/bin/python3
"""Draws what `gelslam-lab benchmark -o BENCH` wrote, into the same folder:
accuracy.png (errors per object and axis) and error_over_time.png (mean error with one standard deviation shaded, over trials).

Example: gelslam-lab benchmark data/TactileTracking -o BENCH && scripts/plot_benchmark.py BENCH
"""

import argparse
import pathlib

import numpy as np

from plotting import NAMES, color, in_order, plt, read_table, save

AXES = ("x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg")
TITLES = ("x (mm)", "y (mm)", "z (mm)", "rotation about x (°)", "rotation about y (°)", "rotation about z (°)")


def read(folder, name):
    return read_table(folder / name, "gelslam-lab benchmark -o")


def grid(title, height=6.0, width=12.0):
    figure, axes = plt.subplots(2, 3, figsize=(width, height), dpi=120)
    figure.suptitle(title, fontsize=11)
    return figure, axes.ravel()


def save_with_legend(figure, path):
    """One legend for all plots, below them, where it hides nothing."""
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, [NAMES.get(label, label) for label in labels], fontsize=8, loc="lower center", ncol=len(labels))
    save(figure, path, (0, 0.05, 1, 1))


def draw_accuracy(folder):
    rows = read(folder, "accuracy.csv")
    objects, methods = in_order(r["object"] for r in rows), in_order(r["method"] for r in rows)
    figure, plots = grid("mean absolute error", width=min(max(12.0, 0.3 * len(objects) * len(methods)), 20.0))
    width = 0.8 / len(methods)
    for plot, axis, title in zip(plots, AXES, TITLES):
        for i, method in enumerate(methods):
            by_object = {r["object"]: float(r[axis]) for r in rows if r["method"] == method}
            places = [objects.index(o) - 0.4 + (i + 0.5) * width for o in by_object]
            plot.bar(places, list(by_object.values()), width, color=color(method), label=method)
        plot.set_xticks(range(len(objects)), objects, rotation=60, ha="right", fontsize=7)
        values = [float(r[axis]) for r in rows if float(r[axis]) > 0] or [1.0]
        plot.set_yscale("log")
        plot.set_ylim(10.0 ** np.floor(np.log10(min(values))), 10.0 ** np.ceil(np.log10(1.1 * max(values))))  # whole decades
        plot.yaxis.set_major_formatter("{x:g}")
        plot.set_title(title, fontsize=9)
        plot.grid(True, axis="y", alpha=0.3)
    save_with_legend(figure, folder / "accuracy.png")


def draw_errors(folder):
    rows = read(folder, "frames.csv")
    first = {}  # frame of each trial
    for r in rows:
        first.setdefault((r["object"], r["trial"]), int(r["frame"]))
    figure, plots = grid("absolute error since the first contact: mean over up to %d trials, one standard deviation shaded" % len(first))
    for plot, axis, title in zip(plots, AXES, TITLES):
        for method in in_order(r["method"] for r in rows):
            errors = {}  # by frame since the first contact
            for r in rows:
                if r["method"] == method:
                    error = float(r[axis]) - float(r["true_" + axis])
                    error = abs((error + 180) % 360 - 180) if axis.endswith("deg") else abs(error)
                    errors.setdefault(int(r["frame"]) - first[r["object"], r["trial"]], []).append(error)
            frames = np.array(sorted(errors))
            mean, deviation = (np.array([of(errors[f]) for f in frames]) for of in (np.mean, np.std))
            plot.plot(frames, mean, color=color(method), linewidth=1, label=method)
            plot.fill_between(frames, np.maximum(mean - deviation, 0), mean + deviation, color=color(method), alpha=0.2, linewidth=0)
        plot.set_title(title, fontsize=9)
        plot.set_xlabel("frame", fontsize=8)
        plot.grid(True, alpha=0.3)
    save_with_legend(figure, folder / "error_over_time.png")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bench", type=pathlib.Path, help="folder that gelslam-lab benchmark wrote")
    arguments = parser.parse_args()
    draw_accuracy(arguments.bench)
    draw_errors(arguments.bench)


if __name__ == "__main__":
    main()
