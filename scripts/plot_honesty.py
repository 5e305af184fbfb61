#!/usr/bin/python3
"""Draws what gelslam-lab honesty wrote: what is wrong among the tracked against what is right among the lost, over the gates.

Each curve is one method with the gate of CCS or of SCR turned from end to end, the other where it is by default; the
circle is our gate, the star what the method's status said, by whatever rules. Further down: fewer wrong poses are called tracked.
Further right: fewer right ones are called lost. With keyframes the gates decide what comes next, so there are only stars.

Example: gelslam-lab honesty -o STUDY && scripts/plot_honesty.py STUDY -o docs/benchmarks/honesty.png
"""

import numpy as np

from plotting import NAMES, color, in_order, plt, read_table, save, study_arguments

SOURCES = ("generated", "frame 0", "keyframes")
WRONG = {"wrong": "share of tracked that is wrong by\nmore than 1 mm or 5° where observable",
         "not right": "share of tracked that is wrong by\nmore than 0.3 mm or 2° where observable"}
LEAST = 3e-4  # shares of nothing are drawn here


class Answers:
    """Columns of the answers of one method from one source."""

    def __init__(self, rows):
        self.scr = np.array([float(r["scr"]) for r in rows])
        self.ccs = np.array([float(r["ccs"]) for r in rows])
        self.tracked = np.array([r["tracked"] == "true" for r in rows])
        self.right = np.array([r["right"] == "true" for r in rows])
        self.off = {"wrong": np.array([r["wrong"] == "true" for r in rows]),
                    "not right": np.array([r["shown_right"] == "false" for r in rows])}

    def share(self, tracked, wrong):
        """(share of right answers that are called tracked, share of tracked ones that are wrong)"""
        kept = np.mean(tracked[self.right]) if self.right.any() else 0.0
        return kept, np.mean(self.off[wrong][tracked]) if tracked.any() else 0.0


def curve(answers, gates, knob, wrong):
    shares = []
    for value in np.unique(np.quantile(getattr(answers, knob), np.linspace(0, 1, 201))):
        limit = {**gates, knob: value}
        shares.append(answers.share((answers.scr >= limit["scr"]) & (answers.ccs >= limit["ccs"]), wrong))
    return zip(*[(kept, max(share, LEAST)) for kept, share in shares if kept > 0])


def draw_plot(plot, by_method, gates, knob, wrong):
    for method, answers in by_method.items():
        if knob:
            plot.plot(*curve(answers, gates, knob, wrong), color=color(method), linewidth=1.2)
            kept, share = answers.share((answers.scr >= gates["scr"]) & (answers.ccs >= gates["ccs"]), wrong)
            plot.plot(kept, max(share, LEAST), "o", color=color(method), markersize=5, markerfacecolor="white")
        kept, share = answers.share(answers.tracked, wrong)
        plot.plot(kept, max(share, LEAST), "*", color=color(method), markersize=11, markeredgecolor="black", markeredgewidth=0.5)
    plot.set_yscale("log")
    plot.set_ylim(0.8 * LEAST, 1.2)
    plot.set_xlim(-0.03, 1.03)
    plot.grid(True, which="both", alpha=0.2)
    plot.tick_params(labelsize=7)


def draw(rows, gates, path):
    methods = in_order(r["method"] for r in rows)
    sources = [s for s in SOURCES if any(r["source"] == s for r in rows)]
    columns = [(s, k) for s in sources for k in ((None,) if s == "keyframes" else ("ccs", "scr"))]
    figure, plots = plt.subplots(2, len(columns), figsize=(3.2 * len(columns), 7), dpi=120, squeeze=False, sharex=True, sharey=True)
    for column, (source, knob) in enumerate(columns):
        mine = [r for r in rows if r["source"] == source]
        by_method = {m: Answers([r for r in mine if r["method"] == m]) for m in methods if any(r["method"] == m for r in mine)}
        for plot, wrong in zip(plots[:, column], WRONG):
            draw_plot(plot, by_method, gates, knob, wrong)
        plots[0, column].set_title(source + (", gate of %s turned" % knob.upper() if knob else ""), fontsize=9)
        plots[1, column].set_xlabel("share of right answers called tracked", fontsize=8)
    for plot, wrong in zip(plots[:, 0], WRONG):
        plot.set_ylabel(WRONG[wrong], fontsize=8)
    handles = [plt.Line2D([], [], color=color(m), label=NAMES.get(m, m)) for m in methods]
    handles += [plt.Line2D([], [], color="dimgray", marker="*", linestyle="", markersize=10, label="status"),
                plt.Line2D([], [], color="dimgray", marker="o", linestyle="", markerfacecolor="white",
                           label="SCR ≥ %g and CCS ≥ %g" % (gates["scr"], gates["ccs"]))]
    figure.legend(handles=handles, fontsize=8, loc="lower center", ncol=4)
    save(figure, path, (0, 0.07, 1, 1))


def main():
    arguments = study_arguments(__doc__, "honesty")
    rows = read_table(arguments.study / "honesty_answers.csv", "gelslam-lab honesty -o")
    gates = {k: float(v) for k, v in read_table(arguments.study / "gates.csv", "gelslam-lab honesty -o")[0].items()}
    draw(rows, gates, arguments.output)


if __name__ == "__main__":
    main()
