#!/usr/bin/python3
"""Sums up what scripts/results.sh measured: docs/results.json, the charts, and the figures in README.md and docs/results.md.

A figure in these texts is followed by <!--PART.NAME--> and has as many decimals as it should. `--check` only compares;
tests/docs does.

Example: scripts/results.py build/results DATA
"""

import csv
import json
import math
import pathlib
import re
import shutil
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
FILE = ROOT / "docs/results.json"
CHARTS = ROOT / "docs/benchmarks"
TEXTS = (ROOT / "README.md", ROOT / "docs/results.md")
FIGURE = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)<!--([a-z_]+\.[\w.]+)-->")
COMMITS = re.compile(r"(?<=<!--commits-->).*?(?=<!--/commits-->)", re.S)
HIDDEN = ("ablate_cable", "ablate_thread")


def read(path):
    return json.loads(path.read_text())


def mean(values):
    """Geometric."""
    return math.exp(statistics.fmean(math.log(max(v, 1e-9)) for v in values))


def errors(table):
    return {name: result["trajectory"]["geometric_mean_mm"] for name, result in table.items()}


def axes(maes):
    """Mean over logs and axes, and the worst: mm, degrees."""
    parts = [[mae[a] for mae in maes for a in names] for names in (("x_mm", "y_mm", "z_mm"), ("rx_deg", "ry_deg", "rz_deg"))]
    return {"mean_mm": statistics.fmean(parts[0]), "mean_deg": statistics.fmean(parts[1]), "worst_mm": max(parts[0]), "worst_deg": max(parts[1])}


def of_set(names, start):
    return [n for n in names if n.startswith(start)]


def accuracy(study, data):
    from check_sequences import public_error, geometric_mean
    network, own, flat, optics_own = (read(study / (n + ".json")) for n in ("network", "own", "optics_flat", "optics_own"))
    reference = {n: r for s in ("sequences", "ablation", "optics") for n, r in read(data / s / "reference.json").items()}
    figures = {}
    eight = [n for n in of_set(network, "optics_") if n != "optics_tread9"]
    for name, table in (("public", {n: {"trajectory": {"geometric_mean_mm": public_error(reference[n])}} for n in eight}),
                        ("flat", flat), ("ours", network), ("own", optics_own)):
        values = [errors(table)[n] for n in eight]
        figures.update({"optics_%s" % name: mean(values), "optics_%s_least" % name: min(values), "optics_%s_most" % name: max(values)})
    tracks = of_set(network, "track_")
    for name, maes in (("public", [reference[n]["mae"] for n in tracks]), ("ours", [network[n]["trajectory"]["mae"] for n in tracks])):
        values = [geometric_mean(mae) for mae in maes]
        figures.update({"track_%s_%s" % (name, k): v for k, v in axes(maes).items()})
        figures.update({"track_%s" % name: mean(values), "track_%s_most" % name: max(values)})
    for n in ("scan_peanut360", "scan_pebblescan", "hard_breaks", "hard_polishedball", "hard_polishedrod"):
        ours, public = network[n], reference[n]
        figures.update({n + "_public": public_error(public), n: errors(network)[n], n + "_share": ours["trajectory"]["tracked_share"],
                        n + "_public_share": public["largest_group_share"]})
        if ours["mesh"] and public["mesh"]:
            known = ours["mesh"]["known_pose"]
            figures.update({n + "_mesh": known["accuracy"]["mean_mm"], n + "_mesh_public": public["mesh"]["acc_mean_mm"],
                            n + "_completeness": next(w for w in known["within"] if w["distance_mm"] == 0.1)["completeness"]})
    for end in ("mm", "deg"):
        figures["peanut_end_" + end] = network["scan_peanut360"]["trajectory"]["final_drift_" + end]
        figures["peanut_end_public_" + end] = reference["scan_peanut360"]["final_drift_" + end]
    for label, table in (("network", network), ("own", own)):
        for name, starts in (("sequences", ("track_", "scan_", "hard_")), ("ablation", ("ablate_",))):
            ratios = {n: errors(table)[n] / public_error(reference[n]) for n in table if n.startswith(starts) and n not in HIDDEN and public_error(reference[n])}
            figures.update({"ratio_%s_%s" % (name, label): mean(ratios.values()), "ratio_%s_%s_most" % (name, label): max(ratios.values())})
        figures["silent_" + label] = sum(r["silent"] for r in table.values())
        figures["silent_%s_cable" % label], figures["silent_%s_ball" % label] = (table[n]["silent"] for n in ("ablate_cable", "hard_polishedball"))
        figures["tracked_" + label] = sum(r["frames"]["tracked"] for r in table.values())
    shown = [n for n in network if n.startswith(("track_", "hard_"))]
    figures["sigma_median"] = statistics.median(r for n in shown for r in network[n]["error_over_sigma"])
    figures["sigma_most"] = statistics.quantiles((r for n in shown for r in network[n]["error_over_sigma"]), n=20)[-1]
    demos = [read(study / ("demo%d.json" % seed))["mesh"]["known_pose"]["accuracy"]["mean_mm"] for seed in range(1, 11)]
    figures.update({"demo": statistics.fmean(demos), "demo_least": min(demos), "demo_most": max(demos)})
    draw("accuracy", study / "network.json", "accuracy.png")
    return figures


def live(study, data):
    table, offline = read(study / "live.json"), read(study.parent / "accuracy/network.json")
    same = {n: offline[n] for n in table}
    figures = {"logs": len(table), "dropped": sum(r["frames"]["left_out"] for r in table.values()),
               "frames": sum(r["frames"]["total"] + r["frames"]["left_out"] for r in table.values()),
               "same": sum(errors(table)[n] == errors(offline)[n] for n in table),
               "silent": sum(r["silent"] for r in table.values()), "silent_offline": sum(r["silent"] for r in same.values())}
    for name, results in (("", table), ("_offline", same)):
        tracks = of_set(results, "track_")
        figures["error" + name] = mean(errors(results)[n] for n in tracks)
        figures["sigma_median" + name] = statistics.median(v for r in results.values() for v in r["error_over_sigma"])
    return figures


def stability(study, data):
    rows = read(study / "stability.json")
    figures = {}
    methods = list(dict.fromkeys(r["method"] for r in rows))
    for method in methods:
        mine = [r for r in rows if r["method"] == method]
        ordinary = [r for r in mine if r["chart"] == "overlap" and abs(r["level"] - 0.8) < 1e-6]
        name = method.replace("-", "_")
        cases = sum(r["cases"] for r in mine)
        figures.update({name + "_ordinary": ordinary[0]["right"], name + "_cases": cases,
                        name + "_right": sum(r["right"] * r["cases"] for r in mine) / cases,
                        name + "_wrong": sum(r["silent_failures"] * r["cases"] for r in mine) / cases})
        for chart in ("start x", "missing frames", "noise"):
            held = [r["level"] for r in mine if r["chart"] == chart and r["right"] >= 0.5]
            if held:
                figures["%s_%s" % (name, chart.replace(" ", "_"))] = max(held)
    draw("stability", study, "stability.png")
    return figures


def mechanisms(study, data):
    figures = {}
    for folder in (study, study / "optics"):
        rows = read(folder / "ablation_ratios.json")
        for mechanism in dict.fromkeys(r["without"] for r in rows):
            mine = [r for r in rows if r["without"] == mechanism]
            ratios = [r["error"] for r in mine if r["error"] is not None]
            if folder != study or mechanism not in ("lens", "perspective", "dome"):
                name = mechanism.replace(" ", "_")
                figures.update({name: mean(ratios), name + "_most": max(ratios),
                                name + "_silent": sum(r["silent_without"] for r in mine), "silent_with": sum(r["silent_with"] for r in mine)} if folder == study
                               else {name: mean(ratios)})
        figures["logs" if folder == study else "optics_logs"] = len({r["sequence"] for r in rows})
    draw("ablation", study, "ablation.png")
    return figures


def calibration(study, data):
    figures = {}
    for path in study.glob("*.txt"):
        text = path.read_text()
        name = path.stem
        error, along_x, along_y = map(float, re.search(r"slope error ([\d.]+) .*x ([\d.]+), y ([\d.]+)", text).groups())
        figures.update({name: error, name + "_x": along_x, name + "_y": along_y})
    for presses, models in read(study / "slopes.json").items():
        for model, rings in models.items():
            figures.update({"slope_%s_%s_%s" % (presses, model, ring): read_deg for ring, read_deg in rings.items()})
    return figures


def real(study, data):
    logs = [read(path) for path in sorted(study.glob("*.json"))]
    total = {k: sum(r[k] for r in logs) for k in ("touched", "kept", "still", "moved", "far")}
    return {**total, "logs": len(logs), "share": total["kept"] / total["touched"], "per_mille": 1e3 * total["moved"] / total["still"]}


def real_live(study, data):
    return real(study, data)


def followed(study, data):
    from speed_followed import shares
    rows = [{k: v if k in ("object", "schedule") else float(v) for k, v in row.items()} for row in csv.DictReader(open(study / "speed_followed.csv"))]
    figures = {"%s_%s_%g" % (schedule, unit.replace("/", "_"), low): share
               for schedule in ("offline", "live", "public") for unit in ("mm/s", "degrees/s") for low, _, _, share in shares(rows, schedule, unit)}
    shutil.copy(study / "speed_followed.png", CHARTS)
    return figures


def long(study, data):
    summary = read(study / "long_scan_summary.json")[0]
    draw("long_scan", study, "long_scan.png")
    return {k: summary[k] for k in ("frames", "keyframes", "trials", "components", "memory_mb", "peak_memory_mb", "wrong_frames", "tracked_share", "at_end_mm", "drift_aligned_mm", "mesh_mm")}


def speed(study, data):
    rows = read(study / "speed_accuracy.json")
    of = {r["method"] + ("" if r["knob"] == "default" else "_tuned"): r for r in rows if r["knob"] in ("default", "tuned")}
    default = of["normalflow"]
    figures = {"pairs": default["problems"], "default_ms": default["median_ms"], "default_mm": default["error_mm"]}
    for name, row in of.items():
        figures.update({name + "_time": row["median_ms"] / default["median_ms"], name + "_error": row["relative"]})
    golf = [read(study / ("track_golf-%d/report.json" % i)) for i in (1, 2, 3)]
    for stage in ("surface", "tracking"):
        figures[stage + "_ms"] = statistics.median(r["stages"][stage]["median_ms"] for r in golf)
    figures["frame_ms"] = figures["surface_ms"] + figures["tracking_ms"]
    soak = list(csv.DictReader(open(study / "soak.txt")))[-1]
    figures.update({"soak_" + k: float(soak[k]) for k in ("latency_ms", "dropped", "frames")})
    draw("speed_accuracy", study, "speed_accuracy.png")
    return figures


def public(study, data):
    from plot_side_by_side import medians
    rows = list(csv.DictReader((study / "runs.csv").read_text().splitlines()))
    figures = {}
    for log in dict.fromkeys(r["log"] for r in rows):
        for system in ("public", "gelslam"):
            seconds = medians(study, rows, system, log)
            report = read(next(study.glob("gelslam-*/%s/report.json" % log)))
            figures["%s_%s_s" % (log, system)] = seconds["whole"]
            figures["%s_%s_frame_ms" % (log, system)] = 1e3 * (seconds["surface"] + seconds["tracking"]) / report["frames"]["tracked"]
        figures[log + "_ratio"] = figures[log + "_public_s"] / figures[log + "_gelslam_s"]
    shutil.copy(study / "side_by_side.png", CHARTS)
    return figures


def draw(name, study, chart):
    subprocess.run([ROOT / "scripts" / ("plot_%s.py" % name), study, "-o", CHARTS / chart], check=True, stdout=subprocess.DEVNULL)


def draw_real(out):
    """A dot for each log: what is kept, and how often the pose moves without the picture."""
    from plotting import plt, save
    figure, axis = plt.subplots(figsize=(6, 4), dpi=120)
    for label, part, mark, shade in (("offline", "real", "o", "#1b6ca8"), ("live", "real_live", "x", "#d1495b")):
        logs = [r for r in map(read, sorted((out / part).glob("*.json"))) if r["touched"] and r["still"]]
        axis.plot([r["kept"] / r["touched"] for r in logs], [100 * r["moved"] / r["still"] for r in logs], mark, color=shade, label=label, alpha=0.8,
                  markerfacecolor="none", linestyle="")
    axis.set_xlabel("share of touched frames kept in the map")
    axis.set_ylabel("still pictures whose pose moved (%)")
    axis.set_ylim(bottom=-0.5)
    axis.grid(alpha=0.3)
    axis.legend(loc="lower right", fontsize=8)
    save(figure, CHARTS / "real.png")


def draw_chain(out, figures):
    """Processor time of the whole program against its error, offline, live and public."""
    from plotting import plt, save
    figure, axis = plt.subplots(figsize=(6, 4), dpi=120)
    for label, path, mark, shade in (("offline", "accuracy/network.json", "o", "#1b6ca8"), ("live", "live/live.json", "x", "#2e933c")):
        table = {n: r for n, r in read(out / path).items() if n.startswith("track_")}
        axis.plot([1e3 * r["processor_s"] / r["frames"]["total"] for r in table.values()], errors(table).values(), mark, color=shade, label=label,
                  linestyle="", markerfacecolor="none")
    axis.plot(1e3 * figures["public"]["track_pebble_public_s"] / 245, figures["accuracy"]["track_public"], "s", color="#d1495b",
              label="public system (mean error; time of one)")
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlabel("processor time of the whole program per frame (ms)")
    axis.set_ylabel("pose error (mm)")
    axis.grid(alpha=0.3, which="both")
    axis.legend(loc="lower right", fontsize=8)
    save(figure, CHARTS / "chain.png")


def draw_honesty(out, figures):
    """Wrong answers of each method that it calls right, and the errors of our poses over their stated sigma."""
    import numpy as np
    from plotting import NAMES, color, plt, save
    from scipy.stats import chi2
    figure, (bars, curves) = plt.subplots(1, 2, figsize=(10, 3.8), dpi=120)
    methods = [m for m in NAMES if m.replace("-", "_") + "_wrong" in figures["stability"]]
    shares = [100 * figures["stability"][m.replace("-", "_") + "_wrong"] for m in methods]
    bars.barh([NAMES[m] for m in methods], shares, color=[color(m) for m in methods])
    bars.invert_yaxis()
    bars.set_xlabel("wrong but called right (% of the cases of the stability chart)")
    live_table = read(out / "live/live.json")
    for label, table, style in (("offline", read(out / "accuracy/network.json"), "-"), ("live", live_table, "--")):
        ratios = np.sort([v for n in live_table for v in table[n]["error_over_sigma"]])
        curves.plot(ratios, np.linspace(0, 1, len(ratios)), style, label=label)
    x = np.linspace(0, 3, 200)
    curves.plot(x, chi2.cdf(6 * x * x, 6), ":", color="black", label="as stated")
    curves.set_xlim(0, 3)
    curves.set_xlabel("error / stated sigma")
    curves.set_ylabel("share of the frames")
    curves.grid(alpha=0.3)
    curves.legend()
    save(figure, CHARTS / "honesty.png")


def shown(value, like):
    decimals = len(like.partition(".")[2])
    return "%.*f" % (decimals, value)


def commits(results):
    """The commit, and those of parts that were not measured with it."""
    newest = max((r["commit"] for r in results.values()), key=[r["commit"] for r in results.values()].count)
    others = ["%s: %s" % (part, r["commit"]) for part, r in results.items() if r["commit"] != newest]
    return newest + (" (%s)" % ", ".join(others) if others else "")


def keys(text):
    return [match[2] for match in FIGURE.finditer(text)]


def filled(text, results):
    """The text with its figures as they are in the results; those that were never measured stay."""
    known = {"%s.%s" % (part, name): value for part, r in results.items() for name, value in r["figures"].items()}

    def figure(match):
        value = shown(known[match[2]], match[1]) if match[2] in known else match[1]
        return "%s<!--%s-->" % (value, match[2])
    return COMMITS.sub(commits(results), FIGURE.sub(figure, text))


def main():
    if len(sys.argv) != 3 or sys.argv[1].startswith("-"):
        print(__doc__)
        return 2
    out, data = map(pathlib.Path, sys.argv[1:])
    results = read(FILE) if FILE.exists() else {}
    for collect in (accuracy, stability, mechanisms, calibration, real, live, real_live, followed, long, speed, public):
        study = out / collect.__name__
        if (study / "commit").exists():
            figures = {k: float("%.5g" % v) for k, v in collect(study, data).items()}
            results[collect.__name__] = {"commit": (study / "commit").read_text().strip(), "figures": figures}
    FILE.write_text(json.dumps(results, indent=1) + "\n")
    figures = {part: r["figures"] for part, r in results.items()}
    there = {path.parent.name for path in out.glob("*/commit")}
    for draw_chart, parts in ((draw_chain, {"accuracy", "live", "public"}), (draw_honesty, {"accuracy", "live", "stability"})):
        if parts <= there:
            draw_chart(out, figures)
    if {"real", "real_live"} <= there:
        draw_real(out)
    for path in TEXTS:
        path.write_text(filled(path.read_text(), results))
    print(FILE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
