#!/usr/bin/python3
"""Draws what gelslam-lab guidance wrote: how much of each object is covered, frame by frame.

Example: gelslam-lab guidance -o STUDY && scripts/plot_guidance.py STUDY -o docs/benchmarks/guidance.png
"""

from plotting import COLORS, in_order, plt, read_table, save, study_arguments

LABELS = {"guided": "along the arrow", "fixed": "fixed pattern", "random": "at random"}


def draw(rows, path):
    objects, patterns = (in_order(r[column] for r in rows) for column in ("object", "pattern"))
    figure, plots = plt.subplots(1, len(objects), figsize=(0.6 + 2.9 * len(objects), 2.9), dpi=120, sharey=True, squeeze=False)
    for plot, name in zip(plots[0], objects):
        for color, pattern in zip(COLORS.values(), patterns):
            mine = [r for r in rows if r["object"] == name and r["pattern"] == pattern]
            seeds = in_order(r["seed"] for r in mine)
            curves = [[100 * float(r["covered"]) for r in mine if r["seed"] == seed] for seed in seeds]
            frames = [int(r["frames"]) for r in mine if r["seed"] == seeds[0]]
            for curve in curves:
                plot.plot(frames, curve, color=color, linewidth=0.7, alpha=0.4)
            mean = [sum(values) / len(values) for values in zip(*curves)]
            plot.plot(frames, mean, color=color, linewidth=2, label=LABELS.get(pattern, pattern))
        plot.set_title(name, fontsize=9)
        plot.set_xlabel("frames", fontsize=8)
        plot.set_ylim(0, 100)
        plot.tick_params(labelsize=7)
        plot.grid(True, alpha=0.25)
    plots[0][0].set_ylabel("covered (%)", fontsize=8)
    plots[0][0].legend(fontsize=7, loc="upper left")
    save(figure, path)


def main():
    arguments = study_arguments(__doc__, "guidance")
    draw(read_table(arguments.study / "guidance_curves.csv", "gelslam-lab guidance -o"), arguments.output)


if __name__ == "__main__":
    main()
