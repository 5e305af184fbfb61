#!/usr/bin/python3
"""Measures and draws what wrong optics cost: poses with the true lens, distance or dome times a factor.

Example: scripts/wrong_optics.py DATA/optics -o STUDY
A model that states its optics keeps those; give one that states none (the default is the one that the logs name).
"""

import argparse
import math
import pathlib
import re
import subprocess
import sys

from plotting import COLORS, in_order, plt, read_table, save

FACTORS = (0, 2 / 3, 4 / 3, 5 / 3)
NUMBERS = {"lens k": "lens_k1", "1 / distance": "camera_distance_mm", "dome": "gel_dome_per_mm"}


def scaled(key, value, factor):
    if key == "camera_distance_mm":
        return "%.5g" % (value[0] / factor if factor else 0)
    text = ", ".join("%.5g" % (factor * number) for number in value)
    return "[%s]" % text if len(value) > 1 else text


def variants(truth):
    """For gelslam-lab ablation --set."""
    def text(name, changed):
        return name + ": " + ", ".join("%s=%s" % (key, scaled(key, truth[key], changed.get(key, 1))) for key in NUMBERS.values())
    yield text("true", {})
    yield text("none", dict.fromkeys(NUMBERS.values(), 0))
    for name, key in NUMBERS.items():
        for factor in FACTORS:
            yield text("%s x %.2f" % (name, factor), {key: factor})


def measure(arguments):
    truth = {key: [float(number) for number in re.findall(r"[-+.\deE]+", rest)]
             for key, rest in re.findall(r"^(\w+):(.*)$", (arguments.data / "truth.yaml").read_text(), re.M)}
    logs = sorted(str(path) for path in arguments.data.iterdir() if (path / "true_start_T_currs.npy").exists())
    command = [arguments.lab, "ablation", *logs, "--stress", "none", "-o", str(arguments.output)]
    command += [word for model in arguments.model for word in ("--model", model)]
    command += [word for variant in variants(truth) for word in ("--set", variant)]
    if subprocess.run(command, stdout=subprocess.DEVNULL).returncode != 0:
        sys.exit("wrong_optics: gelslam-lab failed")


def mean(rows, variant):
    errors = [float(r["error_mm"]) for r in rows if r["variant"] == variant]
    return math.exp(sum(map(math.log, errors)) / len(errors))


def draw(rows, path):
    models = in_order(r["model"] for r in rows)
    figure, plots = plt.subplots(1, len(models), figsize=(5.2 * len(models), 3.6), dpi=120, sharey=True, squeeze=False)
    for plot, model in zip(plots[0], models):
        mine = [r for r in rows if r["model"] == model]
        right = mean(mine, "true")
        for name, color in zip(NUMBERS, COLORS.values()):
            errors = {1: right} | {factor: mean(mine, "%s x %.2f" % (name, factor)) for factor in FACTORS}
            plot.plot(sorted(errors), [errors[factor] for factor in sorted(errors)], "o-", color=color, label=name)
        for name, style in (("none", "--"), ("everything on", ":")):
            label = "all three at 0" if name == "none" else "defaults of a GelSight Mini"
            plot.axhline(mean(mine, name), color="dimgray", linestyle=style, linewidth=1, label=label)
        for variant in in_order(r["variant"] for r in mine):
            print("%-24s %-22s %.4f mm, %.2f of that with the true optics" %
                  (pathlib.Path(model).name, variant, mean(mine, variant), mean(mine, variant) / right))
        plot.set_xticks(sorted((1, *FACTORS)), ["0", "2/3", "1", "4/3", "5/3"])
        plot.set_xlabel("assumed / true")
        plot.set_title("model: " + pathlib.Path(model).name, fontsize=9)
        plot.grid(True, alpha=0.25)
    plots[0][0].set_ylabel("pose error, geometric mean (mm)")
    plots[0][0].set_ylim(0, 1.4 * plots[0][0].get_ylim()[1])
    plots[0][0].legend(fontsize=7.5, ncol=2, loc="upper center")
    save(figure, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path, help="folder of logs of one sensor and its truth.yaml")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="folder for tables and wrong_optics.png")
    parser.add_argument("--model", action="append", default=[], help="model that states no optics; may be repeated (default: the logs')")
    parser.add_argument("--lab", default="build/bin/gelslam-lab")
    parser.add_argument("--draw-only", action="store_true", help="the study is there already")
    arguments = parser.parse_args()
    if not arguments.draw_only:
        measure(arguments)
    draw(read_table(arguments.output / "ablation.csv", "wrong_optics.py"), arguments.output / "wrong_optics.png")


if __name__ == "__main__":
    main()
