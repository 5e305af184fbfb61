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
STYLES = {"this program": ("#1b6ca8", "o"), "version before": ("#edae49", "s"), "public system": ("#d1495b", "D"),
          "public system, contact by color": ("#2e933c", "^")}


def shares(rows):
    """(kept of touched, moved of still), percent; no point (nan) where no still pictures are tracked"""
    touched, kept, still, moved = (sum(int(r[k]) for r in rows) for k in ("touched", "kept", "still", "moved"))
    return 100 * kept / max(touched, 1), 100 * moved / still if still else float("nan")


def draw_program(plot, name, by_threshold, side):
    """`side` of the points where the limits are written: 1 right, -1 left"""
    limits = sorted(by_threshold, key=lambda t: [float(v) for v in t.split("/")])
    style = dict(zip(("color", "marker"), STYLES.get(name, ("gray", "^"))))
    label = name if any(moved == moved for _, moved in by_threshold.values()) else name + ": no pair tracked"
    plot.plot(*zip(*[by_threshold[t] for t in limits]), label=label, markersize=5, **style)
    for k, limit in enumerate(sorted(limits, key=lambda t: by_threshold[t][1])):
        if limit == DEFAULT:
            plot.plot(*by_threshold[limit], markersize=11, markerfacecolor="none", markeredgecolor="black", **style)
        plot.annotate(limit, by_threshold[limit], textcoords="offset points", xytext=(9 * side, 9 * k - 4.5 * len(limits)),
                      fontsize=7, color=style["color"], horizontalalignment="left" if side > 0 else "right")


def draw(rows, path):
    points = in_order((r["program"], r["threshold"]) for r in rows)
    logs = set.intersection(*({r["log"] for r in rows if (r["program"], r["threshold"]) == point} for point in points))
    figure, plot = plt.subplots(figsize=(6.7, 4.4), dpi=120)
    for k, name in enumerate(in_order(p for p, _ in points)):
        draw_program(plot, name, {t: shares([r for r in rows if (r["program"], r["threshold"]) == (name, t) and r["log"] in logs])
                                  for p, t in points if p == name}, 1 if k % 2 else -1)
    plot.plot([], [], "o", markersize=11, markerfacecolor="none", markeredgecolor="black", label="default limits")
    plot.margins(x=0.2, y=0.15)
    plot.set_xticks([t for t in plot.get_xticks() if 0 <= t <= 100])
    plot.set(xlabel="touched frames that are kept (tracked), %", ylabel="still pictures that moved, %", ylim=(0, None))
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
