#!/usr/bin/python3
"""Prints and draws what scripts/side_by_side.sh measured: processor time of whole reconstructions and of their stages,
of the public Python system and of gelslam, medians over repetitions, and the ratios.

Example: scripts/plot_side_by_side.py OUT
"""

import csv
import json
import statistics

from plotting import OURS, PUBLIC, in_order, plt, save, study_arguments

# Stages that both systems have, by their own names. The network runs inside of the public one's surface.
STAGES = {"surface": (("surface_info_total", "laplacian", "mask_erosion", "normals"), ("surface",)),
          "tracking": (("normalflow_track",), ("tracking",)),
          "loops": (("loop_detection",), ("loop closure",)),
          "poses": (("pose_graph_solve_standin",), ("finish/poses",)),
          "fusion": (("mesh_fusion",), ("finish/fusion",))}


SYSTEMS = {"public": ("run.json", "timing", "total_s", 1), "gelslam": ("report.json", "stages", "total_ms", 1e3)}


def medians(study, rows, system, log):
    """Seconds of every stage, and of the whole."""
    file, table, field, per_second = SYSTEMS[system]
    runs = [r for r in rows if r["system"] == system and r["log"] == log]
    timings = [json.loads((study / ("%s-%s" % (system, r["repetition"])) / log / file).read_text())[table] for r in runs]
    result = {stage: statistics.median(sum(t[n][field] for n in names[list(SYSTEMS).index(system)] if n in t) for t in timings) / per_second
              for stage, names in STAGES.items()}
    return {**result, "whole": statistics.median(float(r["processor_s"]) for r in runs)}


def main():
    arguments = study_arguments(__doc__, "side_by_side")
    study = arguments.study
    rows = list(csv.DictReader((study / "runs.csv").read_text().splitlines()))
    logs = in_order(r["log"] for r in rows)
    print("| log | stage | public, s | gelslam, s | ratio |\n|---|---|---|---|---|")
    figure, axis = plt.subplots(figsize=(7, 0.9 + 0.7 * len(logs)))
    for i, log in enumerate(logs):
        public, ours = medians(study, rows, "public", log), medians(study, rows, "gelslam", log)
        for stage in ours:
            ratio = "%.1f" % (public[stage] / ours[stage]) if public[stage] > 0 and ours[stage] > 0 else ""
            print("| %s | %s | %.2f | %.2f | %s |" % (log, stage, public[stage], ours[stage], ratio))
        axis.barh(i - 0.2, public["whole"], 0.36, color=PUBLIC, label=None if i else "public Python system")
        axis.barh(i + 0.2, ours["whole"], 0.36, color=OURS, label=None if i else "gelslam")
        axis.text(public["whole"], i, " %.1f times" % (public["whole"] / ours["whole"]), va="center", fontsize=8)
    axis.margins(x=0.12)
    axis.set_yticks(range(len(logs)), logs)
    axis.invert_yaxis()
    axis.set_xlabel("processor time of a whole reconstruction, s")
    axis.legend()
    save(figure, arguments.output)


if __name__ == "__main__":
    main()
