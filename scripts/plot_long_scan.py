#!/usr/bin/python3
"""Draws what gelslam-lab long-scan wrote: keyframes, memory and time per frame along the scan.

Example: gelslam-lab long-scan --frames 45000 -o STUDY && scripts/plot_long_scan.py STUDY -o docs/benchmarks/long_scan.png
"""

from plotting import COLORS, plt, read_table, save, study_arguments

CURVES = (("keyframes", "keyframes"), ("memory_mb", "memory of the scan (MB, resident)"),
          ("frame_ms", "processor time per frame (ms)"))


def draw(studies, path):
    figure, plots = plt.subplots(1, len(CURVES), figsize=(3.6 * len(CURVES), 2.7), dpi=120)
    for color, (name, rows) in zip(COLORS.values(), studies.items()):
        for plot, (column, label) in zip(plots, CURVES):
            plot.plot([int(r["frames"]) for r in rows], [float(r[column]) for r in rows], color=color, label=name)
            plot.set_ylim(bottom=0)
            plot.set_title(label, fontsize=8)
            plot.set_xlabel("frames", fontsize=8)
            plot.tick_params(labelsize=7)
            plot.grid(True, alpha=0.25)
    if len(studies) > 1:
        plots[0].legend(fontsize=7)
    save(figure, path)


def main():
    arguments = study_arguments(__doc__, "long_scan", several=True)
    draw({folder.name: read_table(folder / "long_scan.csv", "gelslam-lab long-scan -o") for folder in arguments.study}, arguments.output)


if __name__ == "__main__":
    main()
