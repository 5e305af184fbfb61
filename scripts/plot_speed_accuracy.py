#!/usr/bin/python3
"""Draws what gelslam-lab speed-accuracy wrote: processor time against error of every method and setting.

Example: gelslam-lab speed-accuracy -o STUDY && scripts/plot_speed_accuracy.py STUDY -o docs/benchmarks/speed_accuracy.png
"""

from matplotlib.ticker import LogLocator, MultipleLocator, NullFormatter
from plotting import NAMES, color, draw_study, plt, save

MARKS = {"default": "*", "tuned": "P", "samples": "o", "points": "o", "iterations": "^", "least iterations": "v", "robust scale": "D"}
KNOB_LABELS = {"o": "samples or points", "^": "most iterations", "v": "least iterations", "D": "robust scale",
               "d": "other", "*": "default", "P": "best baseline settings found"}
LABELLED = ("samples", "points")


def draw_setting(axes, row):
    mark = MARKS.get(row["knob"], "d")
    big = row["knob"] in ("default", "tuned")
    of_method = color(row["method"])
    axes.vlines(row["median_ms"], row["relative_low"], row["relative_high"], color=of_method, linewidth=1.0, alpha=0.6, zorder=2)
    axes.scatter(row["median_ms"], row["relative"], s=220 if mark == "*" else 110 if big else 30, marker=mark, zorder=4 if big else 3,
                 color=of_method, edgecolors="black" if big else "white", linewidths=0.6)
    if row["knob"] in LABELLED:
        axes.annotate(row["value"], (row["median_ms"], row["relative"]), fontsize=6.5, color=of_method, xytext=(4, 3), textcoords="offset points")


def draw_front(axes, rows):
    front = sorted((r["median_ms"], r["relative"]) for r in rows if r["on_front"])
    axes.step(*zip(*front), where="post", color="black", linewidth=1.0, linestyle="--", zorder=2)


def legend_handles(rows):
    methods = [m for m in NAMES if any(r["method"] == m for r in rows)]
    handles = [plt.Line2D([], [], color=color(m), marker="o", linestyle="", label="%s (%d pairs)" % (NAMES[m], pairs_of(rows, m))) for m in methods]
    used = {MARKS.get(r["knob"], "d") for r in rows}
    handles += [plt.Line2D([], [], color="dimgray", marker=m, linestyle="", markersize=11 if m == "*" else 6, label=t)
                for m, t in KNOB_LABELS.items() if m in used]
    handles.append(plt.Line2D([], [], color="dimgray", linewidth=1, label="5 to 95 % of bootstrap draws"))
    handles.append(plt.Line2D([], [], color="black", linestyle="--", linewidth=1, label="Pareto front of the means"))
    return handles


def pairs_of(rows, method):
    return max(r["problems"] for r in rows if r["method"] == method)


def draw(rows, path):
    default = next(r for r in rows if r["method"] == "normalflow" and r["knob"] == "default")
    figure, (all_axes, near) = plt.subplots(1, 2, figsize=(14, 6.2), dpi=120, gridspec_kw={"width_ratios": (1.25, 1)})
    for axes in (all_axes, near):
        for row in rows:
            draw_setting(axes, row)
        draw_front(axes, rows)
        axes.set_xscale("log")
        axes.set_yscale("log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter(NullFormatter())
        axes.set_xlabel("processor time per registration, median, one thread (ms)")
        axes.grid(True, which="both", alpha=0.25)
    all_axes.set_ylabel("error, relative to our default on the same pairs")
    all_axes.legend(handles=legend_handles(rows), fontsize=8, loc="upper left")
    all_axes.set_ylim(top=3 * max(r["relative"] for r in rows))  # room for the legend
    all_axes.set_title("%d pairs of frames, each method from the pose of the frame before; our default: %.4f mm"
                       % (pairs_of(rows, default["method"]), default["error_mm"]), fontsize=9)
    near.set_xlim(default["median_ms"] / 4, default["median_ms"] * 4)
    near.set_ylim(default["relative"] * 0.75, default["relative"] * 1.6)
    near.yaxis.set_major_locator(MultipleLocator(0.1))
    near.set_title("the same, near our default", fontsize=9)
    save(figure, path)


if __name__ == "__main__":
    draw_study(__doc__, "speed-accuracy", "speed_accuracy.json", draw)
