"""What the scripts that draw studies share: colors and names of methods, reading tables, saving pictures."""

import argparse
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

COLORS = {"normalflow": "#1b6ca8", "icp": "#d1495b", "filterreg": "#2e933c", "fpfh": "#8d6a9f", "icp-tuned": "#edae49",
           "filterreg-tuned": "#00798c", "fpfh-tuned": "#30343f"}
NAMES = {"normalflow": "NormalFlow (ours)", "icp": "ICP, point to plane", "filterreg": "FilterReg", "fpfh": "FPFH + RANSAC + ICP",
         "icp-tuned": "ICP, tuned", "filterreg-tuned": "FilterReg, tuned", "fpfh-tuned": "FPFH + RANSAC + ICP, tuned"}


def color(method):
    return COLORS.get(method, "gray")


def program():
    return sys.argv[0].rsplit("/", 1)[-1].removesuffix(".py")


def read_table(path, writer):
    """Rows of a study as dictionaries. `writer`: the command that writes it, for who has not run it."""
    try:
        rows = json.loads(path.read_text())
    except OSError as error:
        sys.exit("%s: %s: %s (write it with %s)" % (program(), path, error.strerror, writer))
    if not rows:
        sys.exit("%s: %s holds no measurements" % (program(), path))
    return rows


def study_arguments(description, name):
    """The command line of a script that draws what the program `name` wrote: `study` and `output`, which is set."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=pathlib.Path, help="folder that %s wrote" % name)
    parser.add_argument("-o", "--output", type=pathlib.Path, help="picture (default: STUDY/%s.png)" % name)
    arguments = parser.parse_args()
    arguments.output = arguments.output or arguments.study / (name + ".png")
    return arguments


def draw_study(description, name, table, draw):
    """The whole of a script that draws a table of what `gelslam-lab NAME` wrote."""
    arguments = study_arguments(description, name.replace("-", "_"))
    draw(read_table(arguments.study / table, "gelslam-lab %s -o" % name), arguments.output)


def in_order(values):
    """Each value once, as they come."""
    return list(dict.fromkeys(values))


def save(figure, path, room=(0, 0, 1, 1)):
    """`room`: left, bottom, right and top of what the plots may fill."""
    figure.tight_layout(rect=room)
    figure.savefig(path)
    plt.close(figure)
    print(path)
