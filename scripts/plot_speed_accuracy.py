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


def legend_handles(rows):
    used = {MARKS.get(r["knob"], "d") for r in rows}
    return [*(mark("%s (%d pairs)" % (name, pairs_of(rows, m)), color(m)) for m, name in NAMES.items() if pairs_of(rows, m)),
            *(mark(text, "dimgray", m, markersize=11 if m == "*" else 6) for m, text in KNOB_LABELS.items() if m in used),
            mark("5 to 95 % of bootstrap draws", "dimgray", "", linestyle="-", linewidth=1),
            mark("Pareto front of the means", "black", "", linestyle="--", linewidth=1)]


def pairs_of(rows, method):
    return max((r["problems"] for r in rows if r["method"] == method), default=0)


def draw(rows, path):
    default = next(r for r in rows if r["method"] == "normalflow" and r["knob"] == "default")
    front = sorted((r["median_ms"], r["relative"]) for r in rows if r["on_front"])
    figure, (all_axes, near) = plt.subplots(1, 2, figsize=(14, 6.2), width_ratios=(1.25, 1))
    for axes in (all_axes, near):
        for row in rows:
            draw_setting(axes, row)
        axes.step(*zip(*front), where="post", color="black", linewidth=1, linestyle="--", zorder=2)
        logarithmic(axes, "x")
        logarithmic(axes, "y")
        axes.set_xlabel("processor time per registration, median, one thread (ms)")
    all_axes.legend(handles=legend_handles(rows), loc="upper left")
    # Above is room for the legend.
    all_axes.set(ylabel="error, relative to our default on the same pairs", ylim=(None, 3 * max(r["relative"] for r in rows)),
                 title="%d pairs of frames, each method from the pose of the frame before; our default: %.4f mm"
                 % (pairs_of(rows, default["method"]), default["error_mm"]))
    near.set(xlim=(default["median_ms"] / 4, default["median_ms"] * 4), ylim=(default["relative"] * 0.75, default["relative"] * 1.6),
             title="the same, near our default")
    near.yaxis.set_major_locator(MultipleLocator(0.1))
    save(figure, path)


if __name__ == "__main__":
    draw_study(__doc__, "speed-accuracy", "speed_accuracy.json", draw)
