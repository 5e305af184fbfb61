#!/usr/bin/python3
"""Prints and draws what scripts/side_by_side.sh measured: processor time of whole reconstructions and of their stages,
of the public Python system and of gelslam, medians over repetitions, and the ratios.

Example: scripts/plot_side_by_side.py OUT
"""

import csv
import json
import statistics

from plotting import in_order, plt, save, study_arguments

# Stages that both systems have, by their own names. The network runs inside of the public one's surface.
STAGES = {"surface": (("surface_info_total", "laplacian", "mask_erosion", "normals"), ("surface",)),
          "tracking": (("normalflow_track",), ("tracking",)),
          "loops": (("loop_detection",), ("loop closure",)),
          "poses": (("pose_graph_solve_standin",), ("finish/poses",)),
          "fusion": (("mesh_fusion",), ("finish/fusion",))}


def stages_of(study, system, log, repetition):
    """Seconds of every stage in one run."""
    if system == "public":
        timing = json.loads((study / ("public-%s" % repetition) / log / "run.json").read_text())["timing"]
        return {s: sum(timing[n]["total_s"] for n in names if n in timing) for s, (names, _) in STAGES.items()}
    timing = json.loads((study / ("gelslam-%s" % repetition) / log / "report.json").read_text())["stages"]
    return {s: sum(timing[n]["total_ms"] for n in names if n in timing) / 1e3 for s, (_, names) in STAGES.items()}


def medians(study, rows, system, log):
    runs = [r for r in rows if r["system"] == system and r["log"] == log]
    stages = [stages_of(study, system, log, r["repetition"]) for r in runs]
    result = {stage: statistics.median(s[stage] for s in stages) for stage in STAGES}
    return {**result, "whole": statistics.median(float(r["processor_s"]) for r in runs)}


def main():
    arguments = study_arguments(__doc__, "side_by_side")
    study = arguments.study
    rows = list(csv.DictReader((study / "runs.csv").read_text().splitlines()))
    logs = in_order(r["log"] for r in rows)
    print("| log | stage | public, s | gelslam, s | ratio |\n|---|---|---|---|---|")
    figure, axis = plt.subplots(figsize=(7, 0.9 + 0.7 * len(logs)), dpi=120)
    for i, log in enumerate(logs):
        public, ours = medians(study, rows, "public", log), medians(study, rows, "gelslam", log)
        for stage in ours:
            ratio = "%.1f" % (public[stage] / ours[stage]) if public[stage] > 0 and ours[stage] > 0 else ""
            print("| %s | %s | %.2f | %.2f | %s |" % (log, stage, public[stage], ours[stage], ratio))
        axis.barh(i - 0.2, public["whole"], 0.36, color="#d1495b", label="public Python system" if i == 0 else None)
        axis.barh(i + 0.2, ours["whole"], 0.36, color="#1b6ca8", label="gelslam" if i == 0 else None)
        axis.text(public["whole"], i, " %.1f times" % (public["whole"] / ours["whole"]), va="center", fontsize=8)
    axis.margins(x=0.12)
    axis.set_yticks(range(len(logs)), logs, fontsize=8)
    axis.invert_yaxis()
    axis.set_xlabel("processor time of a whole reconstruction, s", fontsize=8)
    axis.legend(fontsize=8)
    save(figure, arguments.output)


if __name__ == "__main__":
    main()
