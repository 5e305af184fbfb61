#!/usr/bin/python3
"""Draws what gelslam-lab stability wrote: the share of cases in which each method finds the truth, and in which it is wrong but
called right, against what makes it hard.

Example: gelslam-lab stability -o STUDY && scripts/plot_stability.py STUDY -o docs/benchmarks/stability.png
"""

from plotting import NAMES, color, draw_study, in_order, plt, save

LABELS = {
    "start x": "start off along x (mm)", "start y": "start off along y (mm)", "start z": "start off along z (mm)",
    "start rx": "start off about x (°)", "start ry": "start off about y (°)", "start rz": "start off about z (°)",
    "start": "start off in all six (mm; 10° per mm)", "overlap": "overlap of the two contacts", "noise": "noise (× the camera's)",
    "texture": "height of the texture (× the object's)", "depth": "indentation (× 0.7 mm; flat: × 0.35 mm)",
    "light drift": "light changed, 2 % per frame", "light jump": "light changed at once", "dirt": "grains on the gel",
    "missing frames": "frames from one picture to the next"}
REVERSED = ("overlap", "texture", "depth")  # harder to the right
COLUMNS = 4


def curve(rows, chart, method, column):
    points = sorted((r["level"], r[column]) for r in rows if r["chart"] == chart and r["method"] == method)
    return [p[0] for p in points], [p[1] for p in points]


def ordinary_success(rows, method):
    """Of a method that uses no start: what it reaches where nothing but the start could be hard."""
    levels, shares = curve(rows, "overlap", method, "right")
    near = [s for l, s in zip(levels, shares) if abs(l - 0.8) < 1e-6]
    return near[0] if near else None


def draw_chart(plot, rows, chart, methods):
    for method in methods:
        levels, shares = curve(rows, chart, method, "right")
        if levels:
            plot.plot(levels, shares, "o-", color=color(method), markersize=3.5, linewidth=1.3)
            plot.plot(*curve(rows, chart, method, "silent_failures"), "x--", color=color(method), markersize=3, linewidth=0.9)
        elif chart.startswith("start") and ordinary_success(rows, method) is not None:
            plot.axhline(ordinary_success(rows, method), color=color(method), linewidth=1.3)
    if "normalflow" in methods:
        plot.plot(*curve(rows, chart, "normalflow", "right_where_shown"), ":", color=color("normalflow"), linewidth=1.3)
    plot.axhline(0.5, color="black", linewidth=0.5, alpha=0.5)
    if chart in REVERSED:
        plot.invert_xaxis()
    plot.set_ylim(-0.04, 1.04)
    cases = max(r["cases"] for r in rows if r["chart"] == chart)
    plot.set_title("%s: %d cases each" % (LABELS.get(chart, chart), cases), fontsize=8)
    plot.tick_params(labelsize=7)
    plot.grid(True, alpha=0.25)


def draw(rows, path):
    charts, methods = in_order(r["chart"] for r in rows), in_order(r["method"] for r in rows)
    lines = -(-(len(charts) + 1) // COLUMNS)
    figure, plots = plt.subplots(lines, COLUMNS, figsize=(3.5 * COLUMNS, 2.6 * lines), dpi=120, squeeze=False)
    plots = plots.ravel()
    for plot, chart in zip(plots, charts):
        draw_chart(plot, rows, chart, methods)
    for plot in plots[len(charts):]:
        plot.axis("off")
    handles = [plt.Line2D([], [], color=color(m), marker="o", markersize=4, label=NAMES.get(m, m)) for m in methods]
    if "normalflow" in methods:
        handles.append(plt.Line2D([], [], color=color("normalflow"), linestyle=":",
                                  label="NormalFlow, in the directions\nthat it calls observable"))
    handles.append(plt.Line2D([], [], color="dimgray", linestyle="--", marker="x", markersize=4,
                              label="wrong but called right: beyond 1 mm\nor 5° in a direction called observable"))
    plots[-1].legend(handles=handles, fontsize=8, loc="center", title="share within 0.3 mm and 2°", title_fontsize=9)
    save(figure, path)


if __name__ == "__main__":
    draw_study(__doc__, "stability", "stability.json", draw)
