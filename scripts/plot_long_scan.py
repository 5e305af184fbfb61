#!/usr/bin/python3
"""Draws what gelslam-lab long-scan wrote: keyframes, memory and time per frame along the scan.

Example: gelslam-lab long-scan --frames 45000 -o STUDY && scripts/plot_long_scan.py STUDY -o docs/benchmarks/long_scan.png
"""

from plotting import OURS, draw_study, plt, save

CURVES = {"keyframes": "keyframes", "memory_mb": "memory of the scan (MB, resident)", "frame_ms": "processor time per frame (ms)"}


def draw(rows, path):
    figure, plots = plt.subplots(1, len(CURVES), figsize=(3.6 * len(CURVES), 2.7))
    for plot, (column, label) in zip(plots, CURVES.items()):
        plot.plot(rows["frames"], rows[column], color=OURS)
        plot.set(ylim=(0, None), title=label, xlabel="frames")
    save(figure, path)


if __name__ == "__main__":
    draw_study(__doc__, "long-scan", "long_scan.json", draw)
