#!/usr/bin/python3
"""Draws what gelslam-lab ablation wrote: what each mechanism is worth, log by log.

Example: gelslam-lab ablation DATA/sequences -o STUDY && scripts/plot_ablation.py STUDY -o docs/benchmarks/ablation.png
"""

import math

import numpy as np
from matplotlib.ticker import FixedLocator, NullLocator
from scipy.stats import gmean

from plotting import COLORS, draw_study, mark, plt, save

MOST = 8.0  # ratios beyond are drawn at the border
TICKS = (0.125, 0.25, 0.5, 0.8, 1, 1.25, 2, 4, 8)
PALETTE = list(COLORS.values())
PAYS = 1.03  # a mechanism stays that lowers the error by so much


def draw_ratios(plot, rows, mechanisms, sets):
    plot.axvspan(1 / MOST / 1.1, 1, color=PALETTE[1], alpha=0.07, linewidth=0)
    plot.axvline(1, color="dimgray", linewidth=0.8)
    plot.axvline(PAYS, color="dimgray", linewidth=0.8, linestyle=":")
    # Sets side by side within a mechanism's line.
    shifts = np.linspace(-0.28, 0.28, len(sets)) if len(sets) > 1 else [0]
    for line, mechanism in enumerate(mechanisms):
        mine = rows[rows["without"] == mechanism].dropna(subset=["error"])
        if mine.empty:
            continue
        for of_set, shift, shade in zip(sets, shifts, PALETTE * len(sets)):
            ratios = mine[mine["set"] == of_set]["error"].clip(1 / MOST, MOST)
            plot.plot(ratios, np.full(len(ratios), line + shift), "o", markersize=3.5, alpha=0.65, markeredgewidth=0, color=shade)
        mean, worst = gmean(mine["error"].clip(lower=1e-9)), mine.loc[mine["error"].idxmin()]
        plot.plot(np.clip(mean, 1 / MOST, MOST), line, "D", color="black", markersize=5, zorder=4)
        plot.annotate("%.2f %s" % (worst["error"], worst["sequence"]), (1 / MOST, line - 0.34), fontsize=6, color="#7a1f2b", va="center")
        plot.annotate("%.2f" % mean, (MOST, line), fontsize=7, va="center", ha="right", weight="bold")
    plot.set(xscale="log", xlim=(1 / MOST / 1.1, MOST * 1.1), xlabel="error without it / with it (left of 1 it harms)")
    plot.xaxis.set_major_locator(FixedLocator(TICKS))
    plot.xaxis.set_minor_locator(NullLocator())
    plot.xaxis.set_major_formatter("{x:g}")


def draw_silent(plot, rows, mechanisms):
    counts = rows.groupby("without")[["silent_with", "silent_without"]].sum().reindex(mechanisms)
    lines, most = range(len(mechanisms)), max(1, counts.max().max())
    plot.hlines(lines, counts["silent_with"], counts["silent_without"], color="silver", linewidth=1.5, zorder=1)
    plot.plot(counts["silent_with"], lines, "o", color=PALETTE[0], markersize=5)
    plot.plot(counts["silent_without"], lines, "x", color=PALETTE[1], markersize=6, markeredgewidth=1.6)
    plot.set(xlim=(-0.06 * most, 1.06 * most), xlabel="undetected errors")
    plot.xaxis.get_major_locator().set_params(integer=True)


def draw(rows, path):
    mechanisms, sets, models = (list(rows[column].unique()) for column in ("without", "set", "model"))
    figure, plots = plt.subplots(1, 2 * len(models), figsize=(2.2 + 6.2 * len(models), 1.3 + 0.34 * len(mechanisms)), sharey=True,
                                 squeeze=False, width_ratios=(3, 1) * len(models))
    for index, model in enumerate(models):
        mine = rows[rows["model"] == model]
        ratios, silent = plots[0][2 * index:2 * index + 2]
        draw_ratios(ratios, mine, mechanisms, sets)
        draw_silent(silent, mine, mechanisms)
        if len(models) > 1:
            ratios.set_title("model: " + model)
    plots[0][0].set_yticks(range(len(mechanisms)), mechanisms)
    plots[0][0].set_ylim(len(mechanisms) - 0.4, -0.6)
    handles = [*(mark(s, shade, markersize=4) for s, shade in zip(sets, PALETTE * len(sets))), mark("geometric mean", "black", "D"),
               mark("undetected with it", PALETTE[0]), mark("undetected without it", PALETTE[1], "x")]
    columns = min(len(handles), 6)
    figure.legend(handles=handles, loc="lower center", ncol=columns)
    save(figure, path, (0, (0.1 + 0.2 * math.ceil(len(handles) / columns)) / figure.get_figheight(), 1, 1))


if __name__ == "__main__":
    draw_study(__doc__, "ablation", "ablation_ratios.json", draw)
