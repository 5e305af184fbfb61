#!/usr/bin/python3
"""Draws what build/bin/speed_accuracy wrote: processor time against error of every method and setting.

Example: build/bin/speed_accuracy -o STUDY && scripts/plot_speed_accuracy.py STUDY -o docs/benchmarks/speed_accuracy.png
"""

import argparse
import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

COLOURS = {"normalflow": "#1b6ca8", "icp": "#d1495b", "filterreg": "#2e933c", "fpfh": "#8d6a9f"}
NAMES = {"normalflow": "NormalFlow (ours)", "icp": "ICP, point to plane", "filterreg": "FilterReg", "fpfh": "FPFH + RANSAC + ICP"}
MARKS = {"default": "*", "tuned": "P", "samples": "o", "points": "o", "iterations": "^", "least iterations": "v", "resolution": "s",
         "robust scale": "D", "tolerance": "x"}
KNOB_LABELS = {"o": "samples or points", "^": "most iterations", "v": "least iterations", "s": "resolution", "D": "robust scale",
               "x": "tolerance", "d": "other", "*": "default", "P": "best baseline settings found"}
LABELLED = ("samples", "points", "resolution")


def read_rows(folder):
    path = folder / "speed_accuracy.csv"
    try:
        with open(path, newline="") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        sys.exit("plot_speed_accuracy: %s: %s (write it with build/bin/speed_accuracy -o)" % (path, error.strerror))
    for row in rows:
        row["ms"], row["mm"] = float(row["median_ms"]), float(row["error_mm"])
        row["front"] = row["on_front"] == "true"
    if not rows:
        sys.exit("plot_speed_accuracy: %s holds no measurements" % path)
    return rows


def draw(rows, path):
    figure, axes = plt.subplots(figsize=(10, 6.4), dpi=130)
    for row in rows:
        mark = MARKS.get(row["knob"], "d")
        big = row["knob"] in ("default", "tuned")
        colour = COLOURS.get(row["method"], "grey")
        style = {"color": colour} if mark == "x" else {"color": colour, "edgecolors": "black" if big else "white", "linewidths": 0.6}
        axes.scatter(row["ms"], row["mm"], s=260 if mark == "*" else 120 if big else 34, marker=mark, zorder=4 if big else 3, **style)
        if row["knob"] in LABELLED:
            axes.annotate(row["value"], (row["ms"], row["mm"]), fontsize=6.5, color=colour, xytext=(4, 3), textcoords="offset points")
    front = sorted((r["ms"], r["mm"]) for r in rows if r["front"])
    axes.step(*zip(*front), where="post", color="black", linewidth=1.0, linestyle="--", zorder=2, label="Pareto front")
    methods = [m for m in NAMES if any(r["method"] == m for r in rows)]
    handles = [plt.Line2D([], [], color=COLOURS[m], marker="o", linestyle="", label=NAMES[m]) for m in methods]
    used = {MARKS.get(r["knob"], "d") for r in rows}
    handles += [plt.Line2D([], [], color="dimgrey", marker=m, linestyle="", markersize=11 if m == "*" else 6, label=t)
                for m, t in KNOB_LABELS.items() if m in used]
    handles.append(plt.Line2D([], [], color="black", linestyle="--", linewidth=1, label="Pareto front"))
    axes.legend(handles=handles, fontsize=8, loc="upper left", bbox_to_anchor=(0.0, 1.0), ncol=2)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("processor time per registration, median, one thread (ms)")
    axes.set_ylabel("geometric mean of six axis errors (mm; 1° = 0.087 mm)")
    axes.set_title("%s pairs of frames, each method from the pose of the frame before" % rows[0]["problems"], fontsize=10)
    axes.grid(True, which="both", alpha=0.25)
    figure.tight_layout()
    figure.savefig(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=pathlib.Path, help="folder that speed_accuracy wrote")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="picture (default: STUDY/speed_accuracy.png)")
    arguments = parser.parse_args()
    path = arguments.output or arguments.study / "speed_accuracy.png"
    draw(read_rows(arguments.study), path)
    print(path)


if __name__ == "__main__":
    main()
