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


def read(path):
    return json.loads(path.read_text())


def mean(values):
    """Geometric."""
    return math.exp(statistics.fmean(math.log(max(v, 1e-9)) for v in values))


def errors(table):
    return {name: result["trajectory"]["geometric_mean_mm"] for name, result in table.items()}


def axes(maes):
    """Mean over logs and axes, and the worst: mm, degrees."""
    values = {unit: [mae[axis] for mae in maes for axis in mae if axis.endswith(unit)] for unit in ("_mm", "_deg")}
    return {what + unit: of(values[unit]) for what, of in (("mean", statistics.fmean), ("worst", max)) for unit in values}


def spread(name, values):
    values = list(values)
    return {name: mean(values), name + "_least": min(values), name + "_most": max(values)}


def of_set(names, start):
    return [n for n in names if n.startswith(start)]


def accuracy(study, data):
    from check_sequences import HIDDEN, geometric_mean, public_error
    network, own, flat, optics_own = (read(study / (n + ".json")) for n in ("network", "own", "optics_flat", "optics_own"))
    reference = {n: r for s in ("sequences", "ablation", "optics") for n, r in read(data / s / "reference.json").items()}
    figures = {}
    eight = [n for n in of_set(network, "optics_") if n != "optics_tread9"]
    for name, table in (("public", {n: public_error(reference[n]) for n in eight}), ("flat", errors(flat)),
                        ("ours", errors(network)), ("own", errors(optics_own))):
        figures.update(spread("optics_" + name, (table[n] for n in eight)))
    tracks = of_set(network, "track_")
    for name, maes in (("public", [reference[n]["mae"] for n in tracks]), ("ours", [network[n]["trajectory"]["mae"] for n in tracks])):
        figures.update({"track_%s_%s" % (name, k): v for k, v in axes(maes).items()}, **spread("track_" + name, map(geometric_mean, maes)))
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
            judged = (n for n in table if n.startswith(starts) and n not in HIDDEN and public_error(reference[n]))
            figures.update(spread("ratio_%s_%s" % (name, label), (errors(table)[n] / public_error(reference[n]) for n in judged)))
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
    return {"logs": len(table), "dropped": sum(r["frames"]["left_out"] for r in table.values()),
            "frames": sum(r["frames"]["total"] + r["frames"]["left_out"] for r in table.values()),
            "same": sum(errors(table)[n] == errors(offline)[n] for n in table),
            "silent": sum(r["silent"] for r in table.values()), "silent_offline": sum(offline[n]["silent"] for n in table)}


def stability(study, data):
    rows = read(study / "stability.json")
    figures = {}
    for method in dict.fromkeys(r["method"] for r in rows):
        mine = [r for r in rows if r["method"] == method]
        name, cases = method.replace("-", "_"), sum(r["cases"] for r in mine)
        ordinary = next(r["right"] for r in mine if r["chart"] == "overlap" and abs(r["level"] - 0.8) < 1e-6)
        figures.update({name + "_ordinary": ordinary, name + "_cases": cases,
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
            name, mine = mechanism.replace(" ", "_"), [r for r in rows if r["without"] == mechanism]
            ratios = [r["error"] for r in mine if r["error"] is not None]
            if folder != study:
                figures[name] = mean(ratios)
            elif mechanism not in ("lens", "perspective", "dome"):
                figures.update(spread(name, ratios))
                figures.update({name + "_silent": sum(r["silent_without"] for r in mine), "silent_with": sum(r["silent_with"] for r in mine)})
        figures["logs" if folder == study else "optics_logs"] = len({r["sequence"] for r in rows})
    draw("ablation", study, "ablation.png")
    return figures


def calibration(study, data):
    figures = {}
    for path in study.glob("*.txt"):
        words = re.search(r"slope error ([\d.]+) .*x ([\d.]+), y ([\d.]+)", path.read_text())
        figures.update(zip((path.stem, path.stem + "_x", path.stem + "_y"), map(float, words.groups())))
    for presses, models in read(study / "slopes.json").items():
        for model, rings in models.items():
            figures.update({"slope_%s_%s_%s" % (presses, model, ring): read_deg for ring, read_deg in rings.items()})
    shutil.copy(study / "slopes.png", CHARTS)
    return figures


def real(study, data):
    logs = [read(path) for path in sorted(study.glob("*.json"))]
    total = {k: sum(r[k] for r in logs) for k in ("touched", "kept", "still", "moved", "far")}
    return {**total, "logs": len(logs), "share": total["kept"] / total["touched"]}


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


PARTS = {"accuracy": accuracy, "stability": stability, "mechanisms": mechanisms, "calibration": calibration, "real": real, "live": live,
         "real_live": real, "followed": followed, "long": long, "speed": speed, "public": public}


def draw(name, study, chart):
    subprocess.run([ROOT / "scripts" / ("plot_%s.py" % name), study, "-o", CHARTS / chart], check=True, stdout=subprocess.DEVNULL)


def draw_real(out, figures):
    """A dot for each log: what is kept, and how often the pose moves without the picture."""
    from plotting import OURS, PUBLIC, plt, save
    figure, axis = plt.subplots(figsize=(6, 4))
    for label, part, mark, shade in (("offline", "real", "o", OURS), ("live", "real_live", "x", PUBLIC)):
        logs = [r for r in map(read, sorted((out / part).glob("*.json"))) if r["touched"] and r["still"]]
        axis.plot([r["kept"] / r["touched"] for r in logs], [100 * r["moved"] / r["still"] for r in logs], mark, color=shade, label=label, alpha=0.8,
                  markerfacecolor="none", linestyle="")
    axis.set(xlabel="share of touched frames kept in the map", ylabel="still pictures whose pose moved (%)", ylim=(-0.5, None))
    axis.legend(loc="lower right")
    save(figure, CHARTS / "real.png")


def draw_chain(out, figures):
    """Processor time of the whole program against its error, offline, live and public."""
    from plotting import COLORS, OURS, PUBLIC, logarithmic, plt, save
    figure, axis = plt.subplots(figsize=(6, 4))
    for label, path, mark, shade in (("offline", "accuracy/network.json", "o", OURS), ("live", "live/live.json", "x", COLORS["filterreg"])):
        table = {n: r for n, r in read(out / path).items() if n.startswith("track_")}
        axis.plot([1e3 * r["processor_s"] / r["frames"]["total"] for r in table.values()], errors(table).values(), mark, color=shade, label=label,
                  linestyle="", markerfacecolor="none")
    axis.plot(1e3 * figures["public"]["track_pebble_public_s"] / 245, figures["accuracy"]["track_public"], "s", color=PUBLIC,
              label="public system (mean error; time of one)")
    axis.set(xlabel="processor time of the whole program per frame (ms)", ylabel="pose error (mm)")
    logarithmic(axis, "x")
    logarithmic(axis, "y")
    axis.legend(loc="lower right")
    save(figure, CHARTS / "chain.png")


def draw_honesty(out, figures):
    """Wrong answers of each method that it calls right, and the errors of our poses over their stated sigma."""
    import numpy as np
    from plotting import NAMES, color, plt, save
    from scipy.stats import chi2
    figure, (bars, curves) = plt.subplots(1, 2, figsize=(10, 3.8))
    methods = [m for m in NAMES if m.replace("-", "_") + "_wrong" in figures["stability"]]
    shares = [100 * figures["stability"][m.replace("-", "_") + "_wrong"] for m in methods]
    bars.barh([NAMES[m] for m in methods], shares, color=[color(m) for m in methods])
    bars.invert_yaxis()
    bars.set_xlabel("wrong but called right (% of the cases of the stability chart)")
    offline, live_table = read(out / "accuracy/network.json"), read(out / "live/live.json")
    for label, table, style in (("offline", offline, "-"), ("live", live_table, "--")):
        ratios = np.sort([v for n in live_table for v in table[n]["error_over_sigma"]])
        curves.plot(ratios, np.linspace(0, 1, len(ratios)), style, label=label)
    x = np.linspace(0, 3, 200)
    curves.plot(x, chi2.cdf(6 * x * x, 6), ":", color="black", label="as stated")
    curves.set(xlim=(0, 3), xlabel="error / stated sigma", ylabel="share of the frames")
    curves.legend()
    save(figure, CHARTS / "honesty.png")


def commits(results):
    """The commit, and those of parts that were not measured with it."""
    newest = statistics.mode(r["commit"] for r in results.values())
    others = ["%s: %s" % (part, r["commit"]) for part, r in results.items() if r["commit"] != newest]
    return newest + (" (%s)" % ", ".join(others) if others else "")


def keys(text):
    return [match[2] for match in FIGURE.finditer(text)]


def filled(text, results):
    """The text with its figures as they are in the results; those that were never measured stay."""
    known = {"%s.%s" % (part, name): value for part, r in results.items() for name, value in r["figures"].items()}

    def figure(match):
        decimals = len(match[1].partition(".")[2])
        return "%s<!--%s-->" % ("%.*f" % (decimals, known[match[2]]) if match[2] in known else match[1], match[2])
    return COMMITS.sub(commits(results), FIGURE.sub(figure, text))


def main():
    if len(sys.argv) != 3 or sys.argv[1].startswith("-"):
        print(__doc__)
        return 2
    out, data = map(pathlib.Path, sys.argv[1:])
    results = read(FILE) if FILE.exists() else {}
    there = {path.parent.name for path in out.glob("*/commit")}
    for part in (p for p in PARTS if p in there):
        figures = {k: float("%.5g" % v) for k, v in PARTS[part](out / part, data).items()}
        results[part] = {"commit": (out / part / "commit").read_text().strip(), "figures": figures}
    FILE.write_text(json.dumps(results, indent=1) + "\n")
    for draw_chart, parts in ((draw_chain, {"accuracy", "live", "public"}), (draw_honesty, {"accuracy", "live", "stability"}),
                              (draw_real, {"real", "real_live"})):
        if parts <= there:
            draw_chart(out, {part: r["figures"] for part, r in results.items()})
    for path in TEXTS:
        path.write_text(filled(path.read_text(), results))
    print(FILE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
