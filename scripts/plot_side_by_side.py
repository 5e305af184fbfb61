#!/usr/bin/python3
"""Prints and draws what scripts/side_by_side.sh measured: processor time of whole reconstructions and of their stages,
of the public Python system and of gelslam, medians over repetitions, and the ratios.

Example: scripts/plot_side_by_side.py OUT
"""

import json

import pandas as pd

from plotting import OURS, PUBLIC, plt, save, study_arguments

# Stages that both systems have, by their own names. The network runs inside of the public one's surface.
STAGES = {"public": {"surface": ("surface_info_total", "laplacian", "mask_erosion", "normals"), "tracking": ("normalflow_track",),
                     "loops": ("loop_detection",), "poses": ("pose_graph_solve_standin",), "fusion": ("mesh_fusion",)},
          "gelslam": {"surface": ("surface",), "tracking": ("tracking",), "loops": ("loop closure",), "poses": ("finish/poses",),
                      "fusion": ("finish/fusion",)}}


def seconds(study, run):
    """Of every stage of a run, and of the whole."""
    folder = study / f"{run.system}-{run.repetition}" / run.log
    if run.system == "public":
        timing = {name: t["total_s"] for name, t in json.loads((folder / "run.json").read_text())["timing"].items()}
    else:
        timing = {name: t["total_ms"] / 1e3 for name, t in json.loads((folder / "report.json").read_text())["stages"].items()}
    stages = {stage: sum(timing.get(name, 0) for name in names) for stage, names in STAGES[run.system].items()}
    return pd.Series({**stages, "whole": run.processor_s})


def timed(study):
    """A row for each run: its log, system and repetition, and seconds by stage."""
    runs = pd.read_csv(study / "runs.csv")
    return runs.join(runs.apply(lambda run: seconds(study, run), axis="columns"))


def medians(study):
    """Seconds by log and stage, a column for each system."""
    return timed(study).groupby(["log", "system"], sort=False)[[*STAGES["public"], "whole"]].median().stack().unstack("system")


if __name__ == "__main__":
    arguments = study_arguments(__doc__, "side_by_side")
    table = medians(arguments.study)
    print("| log | stage | public, s | gelslam, s | ratio |\n|---|---|---|---|---|")
    for (log, stage), row in table.iterrows():
        ratio = "%.1f" % (row.public / row.gelslam) if row.min() > 0 else ""
        print("| %s | %s | %.2f | %.2f | %s |" % (log, stage, row.public, row.gelslam, ratio))
    whole = table.xs("whole", level=1)
    figure, axis = plt.subplots(figsize=(7, 0.9 + 0.7 * len(whole)))
    for i, row in enumerate(whole.itertuples()):
        axis.barh(i - 0.2, row.public, 0.36, color=PUBLIC, label=None if i else "public Python system")
        axis.barh(i + 0.2, row.gelslam, 0.36, color=OURS, label=None if i else "gelslam")
        axis.text(row.public, i, " %.1f times" % (row.public / row.gelslam), va="center", fontsize=8)
    axis.margins(x=0.12)
    axis.set_yticks(range(len(whole)), whole.index)
    axis.invert_yaxis()
    axis.set_xlabel("processor time of a whole reconstruction, s")
    axis.legend()
    save(figure, arguments.output)
