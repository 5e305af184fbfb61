#!/usr/bin/python3
"""Draws what build/bin/speed_accuracy wrote: processor time against error of every method and setting.

Example: build/bin/speed_accuracy -o STUDY && scripts/plot_speed_accuracy.py STUDY -o docs/benchmarks/speed_accuracy.png
"""

from plotting import NAMES, colour, plt, read_table, save, study_arguments

MARKS = {"default": "*", "tuned": "P", "samples": "o", "points": "o", "iterations": "^", "least iterations": "v", "resolution": "s",
         "robust scale": "D", "tolerance": "x"}
KNOB_LABELS = {"o": "samples or points", "^": "most iterations", "v": "least iterations", "s": "resolution", "D": "robust scale",
               "x": "tolerance", "d": "other", "*": "default", "P": "best baseline settings found"}
LABELLED = ("samples", "points", "resolution")


def read_rows(folder):
    rows = read_table(folder / "speed_accuracy.csv", "build/bin/speed_accuracy -o")
    for row in rows:
        row["ms"], row["mm"] = float(row["median_ms"]), float(row["error_mm"])
        row["front"] = row["on_front"] == "true"
    return rows


def draw(rows, path):
    figure, axes = plt.subplots(figsize=(10, 6.4), dpi=130)
    for row in rows:
        mark = MARKS.get(row["knob"], "d")
        big = row["knob"] in ("default", "tuned")
        of_method = colour(row["method"])
        style = {"color": of_method} if mark == "x" else {"color": of_method, "edgecolors": "black" if big else "white", "linewidths": 0.6}
        axes.scatter(row["ms"], row["mm"], s=260 if mark == "*" else 120 if big else 34, marker=mark, zorder=4 if big else 3, **style)
        if row["knob"] in LABELLED:
            axes.annotate(row["value"], (row["ms"], row["mm"]), fontsize=6.5, color=of_method, xytext=(4, 3), textcoords="offset points")
    front = sorted((r["ms"], r["mm"]) for r in rows if r["front"])
    axes.step(*zip(*front), where="post", color="black", linewidth=1.0, linestyle="--", zorder=2, label="Pareto front")
    methods = [m for m in NAMES if any(r["method"] == m for r in rows)]
    handles = [plt.Line2D([], [], color=colour(m), marker="o", linestyle="", label=NAMES[m]) for m in methods]
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
    save(figure, path)


def main():
    arguments = study_arguments(__doc__, "speed_accuracy")
    draw(read_rows(arguments.study), arguments.output)


if __name__ == "__main__":
    main()
