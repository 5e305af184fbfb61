#!/usr/bin/python3
"""Draws what gelslam-lab tracking wrote: how far the program's tracker follows, against what makes it hard.

Example: gelslam-lab tracking -o STUDY && scripts/plot_tracking.py STUDY -o docs/benchmarks/tracking.png
"""

from plotting import COLORS, in_order, plt, read_table, save, study_arguments

LABELS = {
    "slid at once": "slid between two pictures (mm)", "twisted at once": "twisted between two pictures (°)",
    "tilted at once": "tilted between two pictures (°)", "overlap left": "overlap left by a roll between two pictures",
    "pictures left out": "pictures left out, simulated rolls", "pictures left out (recorded)": "pictures left out, track_*",
    "noise": "noise (× the camera's)", "texture": "height of the texture (× the object's)", "depth": "indentation (× 0.7 mm; flat: × 0.35 mm)",
    "light drift": "light changed over a second", "light jump": "light changed at once", "dirt": "grains on the gel"}
FOLLOWERS = {
    "tracker": (COLORS["normalflow"], "-", "the tracker as the program runs it"),
    "tracker without search": ("#5aa9e6", "-", "without the search far away"),
    "registration alone": ("black", "-", "one registration per picture")}
REVERSED = ("overlap left", "texture", "depth")  # harder to the right
COLUMNS = 4


def curve(rows, follower, column):
    points = sorted((float(r["level"]), float(r[column])) for r in rows if r["follower"] == follower)
    return [p[0] for p in points], [p[1] for p in points]


def draw_chart(plot, rows, chart):
    for follower, (color, line, _) in FOLLOWERS.items():
        plot.plot(*curve(rows, follower, "followed"), line, marker="o", color=color, markersize=3, linewidth=2.2 if follower == "tracker" else 1.1,
                  zorder=3 if follower == "tracker" else 2)
    plot.fill_between(*curve(rows, "tracker", "silent_failures"), color=COLORS["normalflow"], alpha=0.2, linewidth=0)
    if chart in REVERSED:
        plot.invert_xaxis()
    plot.set_ylim(-0.04, 1.04)
    plot.set_title("%s: %d steps" % (LABELS.get(chart, chart), max(int(r["steps"]) for r in rows)), fontsize=8)
    plot.tick_params(labelsize=7)
    plot.grid(True, alpha=0.25)


def draw(rows, path):
    charts = in_order(r["chart"] for r in rows)
    lines = -(-len(charts) // COLUMNS)
    figure, plots = plt.subplots(lines, COLUMNS, figsize=(3.5 * COLUMNS, 2.6 * lines + 0.6), dpi=120, squeeze=False)
    plots = plots.ravel()
    for plot, chart in zip(plots, charts):
        draw_chart(plot, [r for r in rows if r["chart"] == chart], chart)
    for plot in plots[len(charts):]:
        plot.axis("off")
    handles = [plt.Line2D([], [], color=color, linestyle=line, marker="o", markersize=4, label=label)
               for color, line, label in FOLLOWERS.values()]
    handles.append(plt.Rectangle((0, 0), 1, 1, color=COLORS["normalflow"], alpha=0.2, linewidth=0,
                                 label="of the tracker's: wrong without a word (beyond 1 mm or 5° where it says shown)"))
    figure.legend(handles=handles, fontsize=8, loc="lower center", ncol=len(handles), title="share of steps tracked within 0.3 mm and 2°",
                  title_fontsize=8.5)
    save(figure, path, (0, 0.6 / figure.get_figheight(), 1, 1))


def main():
    arguments = study_arguments(__doc__, "tracking")
    draw(read_table(arguments.study / "tracking.csv", "gelslam-lab tracking -o"), arguments.output)


if __name__ == "__main__":
    main()
