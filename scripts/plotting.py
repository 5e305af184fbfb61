"""What the scripts that draw studies share: colors and names of methods, how charts look, the command line, saving pictures."""

import argparse
import pathlib
import sys

import matplotlib.pyplot as plt
import pandas as pd
from matplotlib.ticker import LogLocator, NullFormatter

plt.switch_backend("Agg")
plt.rcParams.update({"figure.dpi": 120, "axes.grid": True, "axes.axisbelow": True, "grid.alpha": 0.25, "axes.titlesize": 8,
                     "axes.labelsize": 9, "xtick.labelsize": 8, "ytick.labelsize": 8, "legend.fontsize": 8})
COLORS = {"normalflow": "#1b6ca8", "icp": "#d1495b", "filterreg": "#2e933c", "fpfh": "#8d6a9f", "icp-tuned": "#edae49",
          "filterreg-tuned": "#00798c", "fpfh-tuned": "#30343f"}
OURS, PUBLIC = COLORS["normalflow"], COLORS["icp"]
NAMES = {"normalflow": "NormalFlow (ours)", "icp": "ICP, point to plane", "filterreg": "FilterReg", "fpfh": "FPFH + RANSAC + ICP",
         "icp-tuned": "ICP, tuned", "filterreg-tuned": "FilterReg, tuned", "fpfh-tuned": "FPFH + RANSAC + ICP, tuned"}


def color(method):
    return COLORS.get(method, "gray")


def mark(label, shade, marker="o", **style):
    """A line of a legend."""
    return plt.Line2D([], [], color=shade, marker=marker, label=label, **{"linestyle": "", "markersize": 5, **style})


def logarithmic(plot, letter):
    """Its axis "x" or "y", with ticks at 1, 2, 5."""
    plot.set(**{letter + "scale": "log"})
    axis = getattr(plot, letter + "axis")
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def study_arguments(description, name, picture=None):
    """The command line of a script that draws what the program `name` wrote: `study` and `output`, which is set."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=pathlib.Path, help=f"what {name} wrote")
    parser.add_argument("-o", "--output", type=pathlib.Path, help=f"picture (default: {picture or f'STUDY/{name}.png'})")
    arguments = parser.parse_args()
    arguments.output = arguments.output or picture or arguments.study / f"{name}.png"
    return arguments


def draw_study(description, name, table, draw):
    """The whole of a script that draws a table of what `gelslam-lab NAME` wrote."""
    arguments = study_arguments(description, name.replace("-", "_"))
    path = arguments.study / table
    if not path.exists():
        sys.exit(f"there is no {path}: write it with gelslam-lab {name} -o")
    draw(pd.read_json(path), arguments.output)


def save(figure, path, room=(0, 0, 1, 1)):
    """`room`: left, bottom, right and top of what the plots may fill."""
    figure.tight_layout(rect=room)
    figure.savefig(path)
    plt.close(figure)
    print(path)
