#!/usr/bin/python3
"""Draws what gelslam-lab stability wrote: the share of cases in which each method finds the truth, and in which it is wrong but
called right, against what makes it hard.

Example: gelslam-lab stability -o STUDY && scripts/plot_stability.py STUDY -o docs/benchmarks/stability.png
"""

import numpy as np

from plotting import NAMES, color, draw_study, mark, plt, save

LABELS = {
    "start x": "start off along x (mm)", "start y": "start off along y (mm)", "start z": "start off along z (mm)",
    "start rx": "start off about x (°)", "start ry": "start off about y (°)", "start rz": "start off about z (°)",
    "start": "start off in all six (mm; 10° per mm)", "overlap": "overlap of the two contacts", "noise": "noise (× the camera's)",
    "texture": "height of the texture (× the object's)", "depth": "indentation (× 0.7 mm; flat: × 0.35 mm)",
    "light drift": "light changed, 2 % per frame", "light jump": "light changed at once", "dirt": "grains on the gel",
    "missing frames": "frames from one picture to the next"}
REVERSED = ("overlap", "texture", "depth")  # harder to the right
COLUMNS = 4


def draw_chart(plot, rows, chart, methods):
    for method in methods:
        mine = rows[rows["method"] == method].sort_values("level")
        curve = mine[mine["chart"] == chart]
        plot.plot(curve["level"], curve["right"], "o-", color=color(method), markersize=3.5, linewidth=1.3)
        plot.plot(curve["level"], curve["silent_failures"], "x--", color=color(method), markersize=3, linewidth=0.9)
        if method == "normalflow":
            plot.plot(curve["level"], curve["right_where_shown"], ":", color=color(method), linewidth=1.3, zorder=3)
        if curve.empty and chart.startswith("start"):
            # It uses no start: what it reaches where nothing but the start could be hard.
            for share in mine[(mine["chart"] == "overlap") & np.isclose(mine["level"], 0.8)]["right"]:
                plot.axhline(share, color=color(method), linewidth=1.3)
    plot.axhline(0.5, color="black", linewidth=0.5, alpha=0.5)
    if chart in REVERSED:
        plot.invert_xaxis()
    cases = rows[rows["chart"] == chart]["cases"].max()
    plot.set(ylim=(-0.04, 1.04), title="%s: %d cases each" % (LABELS.get(chart, chart), cases))


def draw(rows, path):
    charts, methods = rows["chart"].unique(), rows["method"].unique()
    lines = -(-(len(charts) + 1) // COLUMNS)
    figure, plots = plt.subplots(lines, COLUMNS, figsize=(3.5 * COLUMNS, 2.6 * lines), squeeze=False)
    plots = plots.ravel()
    for plot, chart in zip(plots, charts):
        draw_chart(plot, rows, chart, methods)
    for plot in plots[len(charts):]:
        plot.axis("off")
    handles = [mark(NAMES.get(m, m), color(m), linestyle="-") for m in methods]
    if "normalflow" in methods:
        handles.append(mark("NormalFlow, in the directions\nthat it calls observable", color("normalflow"), "", linestyle=":"))
    handles.append(mark("wrong but called right: beyond 1 mm\nor 5° in a direction called observable", "dimgray", "x", linestyle="--"))
    plots[-1].legend(handles=handles, loc="center", title="share within 0.3 mm and 2°", title_fontsize=9)
    save(figure, path)


if __name__ == "__main__":
    draw_study(__doc__, "stability", "stability.json", draw)
