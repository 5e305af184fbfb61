#!/usr/bin/python3
"""Draws what scripts/map_growth.py wrote: processor time, memory and latency against the keyframes of a map.

Example: scripts/map_growth.py STUDY && scripts/plot_map_growth.py STUDY -o docs/benchmarks/map_growth.png
"""

from plotting import OURS, PUBLIC, draw_study, plt, save

PLOTS = {"processor time (s)": {"end_cpu_s": "the end: poses, mesh"},
         "processor time per keyframe (ms)": {"keyframe_ms": "tracking, loops"},
         "peak memory (MB)": {"live_mb": "live", "end_mb": "the end"},
         "latency, live (ms)": {"latency_ms": "median", "latency_p99_ms": "99 %"}}


def draw(rows, path):
    figure, plots = plt.subplots(1, len(PLOTS), figsize=(3.1 * len(PLOTS), 2.7))
    for plot, (title, curves) in zip(plots, PLOTS.items()):
        for (column, label), shade in zip(curves.items(), (OURS, PUBLIC)):
            plot.plot(rows["keyframes"], rows[column], "o-", color=shade, label=label, markersize=4)
        plot.set(ylim=(0, None), xlim=(0, None), title=title, xlabel="keyframes")
        plot.legend()
    save(figure, path)


if __name__ == "__main__":
    draw_study(__doc__, "map-growth", "map_growth.json", draw)
