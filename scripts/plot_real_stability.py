#!/usr/bin/python3
"""Draws what is kept of real logs against what moves although the picture stands still, over the limits of registration.

Input: a CSV with a line per program, limits and log, and the columns program, threshold, log, touched, kept, still, moved.
`threshold` is the least SCR and the least CCS of track_config, as 0.3/0.7. `touched`: frames with contact; `kept`: those
of them that are tracked. `still`: pairs of frames, five apart, tracked in one trial, whose pictures look the same; `moved`:
those of them whose poses differ by more than 0.15 mm or 1.5°. Numbers are summed over the logs that all points have.

Output: a picture, with one curve per program. To the right: more is kept. Further down: less moves.

Example: scripts/plot_real_stability.py real_stability.csv -o docs/images/real_stability.png
"""

import argparse
import pathlib

from plotting import in_order, plt, read_table, save

DEFAULT = "0.3/0.7"
STYLES = {"this program": ("#1b6ca8", "o"), "version before": ("#edae49", "s"), "public system": ("#d1495b", "D")}


def shares(rows):
    """(kept of touched, moved of still), percent"""
    touched, kept, still, moved = (sum(int(r[k]) for r in rows) for k in ("touched", "kept", "still", "moved"))
    return 100 * kept / max(touched, 1), 100 * moved / max(still, 1)


def draw_program(plot, name, by_threshold):
    limits = sorted(by_threshold, key=lambda t: [float(v) for v in t.split("/")])
    points = [by_threshold[t] for t in limits]
    style = dict(zip(("color", "marker"), STYLES.get(name, ("gray", "^"))))
    plot.plot(*zip(*points), label=name, markersize=5, linewidth=1.4, **style)
    for limit, point in zip(limits, points):
        if limit == DEFAULT:
            plot.plot(*point, markersize=11, markerfacecolor="none", markeredgecolor="black", **style)
        plot.annotate(limit, point, textcoords="offset points", xytext=(7, 5), fontsize=7, color=style["color"])


def draw(rows, path):
    points = in_order((r["program"], r["threshold"]) for r in rows)
    logs = set.intersection(*({r["log"] for r in rows if (r["program"], r["threshold"]) == point} for point in points))
    rows = [r for r in rows if r["log"] in logs]
    figure, plot = plt.subplots(figsize=(6.7, 4.4), dpi=120)
    for name in in_order(p for p, _ in points):
        draw_program(plot, name, {t: shares([r for r in rows if (r["program"], r["threshold"]) == (name, t)])
                                  for p, t in points if p == name})
    plot.plot([], [], "o", markersize=11, markerfacecolor="none", markeredgecolor="black", label="default limits")
    plot.set_ylim(bottom=0)
    plot.margins(x=0.12)
    plot.set_xlabel("touched frames that are kept (tracked), %")
    plot.set_ylabel("still pictures that moved, %")
    plot.set_title("%d real logs; beside the points: least SCR/CCS" % len(logs), fontsize=10)
    plot.legend(fontsize=8)
    plot.grid(True, alpha=0.25)
    save(figure, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", type=pathlib.Path, help="CSV of the measured logs")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("real_stability.png"))
    arguments = parser.parse_args()
    draw(read_table(arguments.table, "the referee of the real logs"), arguments.output)


if __name__ == "__main__":
    main()
