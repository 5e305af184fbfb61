#!/usr/bin/python3
"""Draws what gelslam-lab speed-accuracy wrote: processor time against error of every method and setting.

Example: gelslam-lab speed-accuracy -o STUDY && scripts/plot_speed_accuracy.py STUDY -o docs/benchmarks/speed_accuracy.png
"""

from matplotlib.ticker import MultipleLocator

from plotting import NAMES, color, draw_study, logarithmic, mark, plt, save

MARKS = {"default": "*", "tuned": "P", "samples": "o", "points": "o", "iterations": "^", "least iterations": "v", "robust scale": "D"}
KNOB_LABELS = {"o": "samples or points", "^": "most iterations", "v": "least iterations", "D": "robust scale",
               "d": "other", "*": "default", "P": "best baseline settings found"}


def draw_setting(axes, row):
    knob, of_method, place = row["knob"], color(row["method"]), (row["median_ms"], row["relative"])
    big = knob in ("default", "tuned")
    axes.vlines(row["median_ms"], row["relative_low"], row["relative_high"], color=of_method, linewidth=1, alpha=0.6, zorder=2)
    axes.scatter(*place, s=220 if knob == "default" else 110 if big else 30, marker=MARKS.get(knob, "d"), zorder=4 if big else 3,
                 color=of_method, edgecolors="black" if big else "white", linewidths=0.6)
    if knob in ("samples", "points"):
        axes.annotate(row["value"], place, fontsize=6.5, color=of_method, xytext=(4, 3), textcoords="offset points")


def draw(rows, path):
    pairs, used = rows.groupby("method")["problems"].max(), {MARKS.get(knob, "d") for knob in rows["knob"]}
    default = rows[(rows["method"] == "normalflow") & (rows["knob"] == "default")].iloc[0]
    front = rows[rows["on_front"]].sort_values("median_ms")
    figure, (all_axes, near) = plt.subplots(1, 2, figsize=(14, 6.2), width_ratios=(1.25, 1))
    for axes in (all_axes, near):
        rows.apply(lambda row, axes=axes: draw_setting(axes, row), axis="columns")
        axes.step(front["median_ms"], front["relative"], where="post", color="black", linewidth=1, linestyle="--", zorder=2)
        logarithmic(axes, "x")
        logarithmic(axes, "y")
        axes.set_xlabel("processor time per registration, median, one thread (ms)")
    all_axes.legend(loc="upper left", handles=[
        *(mark("%s (%d pairs)" % (name, pairs[m]), color(m)) for m, name in NAMES.items() if m in pairs),
        *(mark(text, "dimgray", m, markersize=11 if m == "*" else 6) for m, text in KNOB_LABELS.items() if m in used),
        mark("5 to 95 % of bootstrap draws", "dimgray", "", linestyle="-", linewidth=1),
        mark("Pareto front of the means", "black", "", linestyle="--", linewidth=1)])
    # Above is room for the legend.
    all_axes.set(ylabel="error, relative to our default on the same pairs", ylim=(None, 3 * rows["relative"].max()),
                 title="%d pairs of frames, each method from the pose of the frame before; our default: %.4f mm"
                 % (pairs["normalflow"], default["error_mm"]))
    near.set(xlim=(default["median_ms"] / 4, default["median_ms"] * 4), ylim=(default["relative"] * 0.75, default["relative"] * 1.6),
             title="the same, near our default")
    near.yaxis.set_major_locator(MultipleLocator(0.1))
    save(figure, path)


if __name__ == "__main__":
    draw_study(__doc__, "speed-accuracy", "speed_accuracy.json", draw)
