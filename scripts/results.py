#!/usr/bin/python3
"""Sums up what scripts/results.sh measured: docs/results.json, the charts, and the figures in README.md and docs/results.md.

These two are rendered from docs/templates, where {PART.NAME:2} is a figure with two decimals and {=0.5} a number that was set
and not measured. A figure that is null in results.json becomes a dash: no run has measured it yet. Without a folder of
results, only renders. tests/docs compares the pages with what this script renders.

Example: GELSLAM_DATA=DATA scripts/results.py build/results
"""

import json
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
from collections import defaultdict

import numpy as np
import pandas as pd
from scipy.stats import binomtest, chi2

import plot_ablation
from check_sequences import in_mean, references, within_100_um
from plot_side_by_side import timed
from plotting import COLORS, NAMES, OURS, PUBLIC, color, logarithmic, plt, save
from speed_followed import shares

ROOT = pathlib.Path(__file__).resolve().parent.parent
FILE = ROOT / "docs/results.json"
CHARTS = ROOT / "docs/benchmarks"
PAGES = {"README.md": "docs/templates/README.md.in", "docs/results.md": "docs/templates/results.md.in"}
MISSING = "\0"  # stands for a figure that is null, until the page is complete
# A spread, a count or a processor that older results lack leaves no trace; any other missing figure is a dash.
NOT_MEASURED = re.compile(r" \([^()]*\0[^()]*\)|\0 (?=independent|cases|frames)")
FIELD = re.compile(r"\{(=?)([\w.]+)(?::(\d))?\}")
ERROR, SHARE, MESH = "trajectory.geometric_mean_mm", "trajectory.tracked_share", "mesh.known_pose.accuracy."
HEADLINE = {"_ate": "trajectory.ate_mm", "_rotation": "trajectory.rotation_rmse_deg"}


def read(path):
    return json.loads(path.read_text())


def by_log(results):
    """Results by log as a table: a row for each, columns such as trajectory.ate_mm."""
    return pd.json_normalize(list(results.values())).set_axis(list(results))


def spread(name, values):
    """Geometric mean, least and most."""
    values = [max(v, 1e-9) for v in values]
    return {name: statistics.geometric_mean(values), name + "_least": min(values), name + "_most": max(values)}


def mean_and_range(name, values):
    return {name: statistics.fmean(values), name + "_least": min(values), name + "_most": max(values)}


def median_and_range(name, values):
    """Of repeated runs."""
    return {**mean_and_range(name, values), name: statistics.median(values)}


def share(name, value, cases):
    """A share of cases, and the ends of its 95 % interval (Wilson)."""
    ends = binomtest(round(value * cases), round(cases)).proportion_ci(method="wilson")
    return {name: value, name + "_least": ends.low, name + "_most": ends.high, name + "_cases": cases}


def headline(name, logs):
    """ATE and rotation RMSE over logs."""
    return {key: value for end, column in HEADLINE.items() for key, value in mean_and_range(name + end, logs[column]).items()}


def of_scan(name, log):
    """ATE, rotation RMSE and the 95th percentile of the mesh's distances to the true surface, of one log."""
    return {**{name + end: log[column] for end, column in HEADLINE.items()}, name + "_mesh_p95": log[MESH + "p95_mm"]}


def eight_objects(names):
    """The eight objects of DATA/optics; tread9 is a scan of one of them."""
    return [n for n in names if n.startswith("optics_") and n != "optics_tread9"]


def accuracy(study):
    reference = references()
    public, (network, own, flat, optics_own) = by_log(reference), (by_log(read(study / f"{n}.json")) for n in ("network", "own", "optics_flat", "optics_own"))
    figures = {}
    eight = eight_objects(network.index)
    for name, errors in (("public", public["error_mm"]), ("flat", flat[ERROR]), ("ours", network[ERROR]), ("own", optics_own[ERROR])):
        figures.update(spread("optics_" + name, errors[eight]))
    for name, some in (("flat", flat), ("ours", network), ("own", optics_own)):
        figures.update(headline("optics_" + name, some.loc[eight]))
    tracks = [n for n in network.index if n.startswith("track_")]
    for name, errors in (("public", public["error_mm"]), ("ours", network[ERROR])):
        figures.update(spread("track_" + name, errors[tracks]))
    figures.update(headline("track_ours", network.loc[tracks]))
    for n in ("scan_peanut360", "scan_pebblescan"):
        figures.update(of_scan(n, network.loc[n]))
    for n in ("scan_peanut360", "scan_pebblescan", "hard_breaks", "hard_polishedball", "hard_polishedrod"):
        ours, theirs = network.loc[n], public.loc[n]
        figures.update({n + "_public": theirs["error_mm"], n: ours[ERROR], n + "_share": ours[SHARE], n + "_public_share": theirs["largest_group_share"]})
        if ours[MESH + "mean_mm"] > 0 and theirs["mesh.acc_mean_mm"] > 0:
            figures.update({n + "_mesh": ours[MESH + "mean_mm"], n + "_mesh_public": theirs["mesh.acc_mean_mm"],
                            n + "_completeness": within_100_um(ours["mesh.known_pose.within"])["completeness"]})
    for end in ("mm", "deg"):
        figures["peanut_end_" + end] = network.loc["scan_peanut360", "trajectory.final_drift_" + end]
        figures["peanut_end_public_" + end] = public.loc["scan_peanut360", "final_drift_" + end]
    for label, some in (("network", network), ("own", own)):
        for name, starts in (("sequences", ("track_", "scan_", "hard_")), ("ablation", ("ablate_",))):
            judged = [n for n in some.index if n.startswith(starts) and in_mean(n, reference[n])]
            figures.update(spread(f"ratio_{name}_{label}", some.loc[judged, ERROR] / public.loc[judged, "error_mm"]))
        silent = some["silent"]
        figures.update({"silent_" + label: silent.sum(), f"silent_{label}_logs": (silent > 0).sum(), "logs_" + label: len(some), f"silent_{label}_cable": silent["ablate_cable"], f"silent_{label}_ball": silent["hard_polishedball"],
                        "tracked_" + label: some["frames.tracked"].sum()})
    shown = network[network.index.str.startswith(("track_", "hard_"))]["error_over_sigma"].explode().astype(float)
    figures.update({"sigma_median": shown.median(), "sigma_most": statistics.quantiles(shown, n=20)[-1], "sigma_frames": shown.count()})
    draw("accuracy", study / "network.json")
    return figures


IN_TABLE = {"ate": "trajectory.ate_mm", "rotation": "trajectory.rotation_rmse_deg", "share": SHARE, "mesh": MESH + "mean_mm", "mesh_p95": MESH + "p95_mm",
            "in_mesh": "mesh.in_mesh"}


def simulated(study):
    """By motion and object, over seeds."""
    logs = by_log({path.stem: read(path) for path in sorted(study.glob("*.json"))})
    logs[["object", "motion", "seed"]] = logs.index.str.split("_", expand=True).to_frame().to_numpy()
    figures = {"logs": len(logs), "seeds": logs["seed"].nunique()}
    for motion, mine in logs.groupby("motion"):
        for object_, some in [*mine.groupby("object"), ("all", mine)]:
            for name, column in IN_TABLE.items():
                if column in some:
                    figures.update(mean_and_range(f"{motion}_{object_}_{name}", some[column].dropna()))
    return figures


def table_of_simulated(figures):
    """The table of the part "simulated": a cell is the mean over the seeds, and the least and the most."""
    lines = ["| motion | object | ATE, mm | rotation, degrees | frames in the map | mesh: mean; 95 %, mm | touched surface in the mesh |", "|---|---|---|---|---|---|---|"]

    def cell(prefix, name, digits):
        mean, least, most = (figures.get(prefix + name + end) for end in ("", "_least", "_most"))
        return "–" if mean is None else f"{mean:.{digits}f} ({least:.{digits}f} to {most:.{digits}f})"
    for key in (k for k in figures if k.endswith("_ate")):
        prefix = key.removesuffix("ate")
        motion, object_ = prefix[:-1].split("_")
        mesh = cell(prefix, "mesh", 3) + "; " + cell(prefix, "mesh_p95", 3)
        lines.append(f"| {motion} | {object_} | {cell(prefix, 'ate', 3)} | {cell(prefix, 'rotation', 2)} | {cell(prefix, 'share', 2)} | {mesh} | {cell(prefix, 'in_mesh', 2)} |")
    return "\n".join(lines)


def demo(study):
    return mean_and_range("mesh", [read(path)["mesh"]["known_pose"]["accuracy"]["mean_mm"] for path in study.glob("*.json")])


def live(study):
    logs, offline = by_log(read(study / "live.json")), by_log(read(study.parent / "accuracy/network.json"))
    offline, left_out = offline.loc[logs.index], logs["frames.left_out"].sum()
    return {"logs": len(logs), "dropped": left_out, "frames": logs["frames.total"].sum() + left_out, "same": (logs[ERROR] == offline[ERROR]).sum(),
            "silent": logs["silent"].sum(), "silent_offline": offline["silent"].sum()}


def stability(study):
    figures = {}
    for method, mine in pd.read_json(study / "stability.json").groupby("method", sort=False):
        name = method.replace("-", "_")
        ordinary = mine[(mine["chart"] == "overlap") & np.isclose(mine["level"], 0.8)].iloc[0]
        right, wrong = np.average(mine[["right", "silent_failures"]], axis=0, weights=mine["cases"])
        cases = mine["cases"].sum()
        figures.update({**share(name + "_ordinary", ordinary["right"], ordinary["cases"]), **share(name + "_wrong", wrong, cases), name + "_right": right})
        held = mine[mine["right"] >= 0.5].groupby("chart")["level"].max()
        figures.update({f"{name}_{chart.replace(' ', '_')}": held[chart] for chart in ("start x", "missing frames", "noise") if chart in held})
    draw("stability", study)
    return figures


def mechanisms(study):
    """Of the optics; what the other mechanisms are worth was measured with programs that can leave them out (left_out)."""
    rows = pd.read_json(study / "ablation_ratios.json")
    figures = {"optics_logs": rows["sequence"].nunique()}
    for name, mine in rows.groupby("without"):
        figures.update(spread(name, mine["error"].dropna()))
    return figures


def left_out():
    """The table of mechanisms that were left out one by one, from docs/benchmarks/left_out*.csv."""
    logs, real = (pd.read_csv(CHARTS / name, keep_default_na=False) for name in ("left_out.csv", "left_out_real.csv"))
    lines = ["| without | rendered logs: error (largest ratio of a log) | undetected errors | real logs: fingers; moved; in the map; breaks | kept for |",
             "|---|---|---|---|---|"]
    for row in real.itertuples(index=False):
        mine = logs[logs["without"] == row.without]
        worst = mine.loc[mine["error"].idxmax()] if len(mine) else None
        changed = "every log the same" if len(mine) and (mine["error"] == 1).all() else None
        error = "1" if worst is None else changed or f"{statistics.geometric_mean(mine['error']):.2f} ({worst['error']:.2f}, `{worst['sequence']}`)"
        silent = logs.groupby("without")["silent_with"].sum().iloc[0] if worst is None else mine["silent_without"].sum()
        poses = f"{row.fingers_deg}°; {row.moved_5}, {row.moved_25}; {row.in_map}; {row.breaks}" if row.breaks != "" else "not measured"
        lines.append(f"| {row.without} | {error} | {silent} | {poses} | {row.kept_for} |")
    return "\n".join(lines)


JUDGED = re.compile(r"slope error ([\d.]+) degrees on (\d+) presses.*x (-?[\d.]+), y (-?[\d.]+)")


def calibration(study):
    figures = {}
    for path in study.glob("*.txt"):
        words, name = JUDGED.search(path.read_text()), path.stem
        each = [float(error) for error, *_ in JUDGED.findall(path.with_suffix(".each").read_text())]
        figures.update({**mean_and_range(name, each), **dict(zip((name, name + "_presses", name + "_x", name + "_y"), map(float, words.groups())))})
    for presses, models in read(study / "slopes.json").items():
        for model, rings in models.items():
            for ring, read_deg in rings.items():
                name = f"slope_{presses}_{model}_{ring}"
                figures.update({name: read_deg["median"], name + "_least": read_deg["low"], name + "_most": read_deg["high"]})
    shutil.copy(study / "slopes.png", CHARTS)
    return figures


def real(study):
    logs = by_log({path.stem: read(path) for path in sorted(study.glob("*.json"))})
    total = logs.sum()
    return {**total, "logs": len(logs), "moved_logs": (logs["moved"] > 0).sum(), **mean_and_range("share", logs["kept"] / logs["touched"]),
            "share": total["kept"] / total["touched"]}


def followed(study):
    shutil.copy(study / "speed_followed.png", CHARTS)
    steps = pd.read_csv(study / "speed_followed.csv")
    found = [(None, shares(steps)), *((object_, shares(mine)) for object_, mine in steps.groupby("object"))]
    figures, of_objects = {}, defaultdict(list)
    for object_, rows in found:
        for s in rows:
            name = f"{s['schedule']}_{s['unit'].replace('/', '_')}_{s['low']:g}"
            if object_ is None:
                figures.update({name: s["share"], name + "_steps": s["steps"]})
            else:
                of_objects[name].append(s["share"])
    for name, values in of_objects.items():
        figures.update({name + "_least": min(values), name + "_most": max(values), name + "_objects": len(values)})
    return figures


def long(study):
    summary = read(study / "long_scan_summary.json")[0]
    draw("long_scan", study)
    return {k: summary[k] for k in ("frames", "keyframes", "trials", "components", "memory_mb", "peak_memory_mb", "wrong_frames", "tracked_share",
                                    "at_end_mm", "drift_aligned_mm", "mesh_mm")}


def growth(study):
    draw("map_growth", study)
    return {f"{row['frames']}_{name}": value for row in read(study / "map_growth.json") for name, value in row.items()}


def speed(study):
    rows = pd.read_json(study / "speed_accuracy.json")
    default = rows[(rows["method"] == "normalflow") & (rows["knob"] == "default")].iloc[0]
    figures = {"pairs": default["problems"], "default_ms": default["median_ms"], "default_mm": default["error_mm"]}
    for row in rows[rows["knob"].isin(("default", "tuned"))].itertuples():
        name = row.method + ("" if row.knob == "default" else "_tuned")
        figures.update({name + "_time": row.median_ms / default["median_ms"], name + "_ms": row.median_ms, name + "_pairs": row.problems,
                        name + "_error": row.relative, name + "_error_least": row.relative_low, name + "_error_most": row.relative_high})
    golf = [read(study / f"track_golf-{i}/report.json")["stages"] for i in (1, 2, 3)]
    medians = {stage: np.array([stages[stage]["median_ms"] for stages in golf]) for stage in ("surface", "tracking")}
    for name, values in {**medians, "frame": sum(medians.values())}.items():
        figures.update(median_and_range(name + "_ms", values))
    soak = pd.read_csv(study / "soak.txt")
    figures.update(median_and_range("soak_latency_ms", soak["latency_ms"]))
    figures.update({"soak_" + k: soak[k].iloc[-1] for k in ("dropped", "frames")})
    draw("speed_accuracy", study)
    return figures


def public(study):
    figures = {}
    for log, runs in timed(study).groupby("log"):
        tracked = read(next(study.glob(f"gelslam-*/{log}/report.json")))["frames"]["tracked"]
        for name, values in (("s", runs["whole"]), ("frame_ms", 1e3 * runs[["surface", "tracking"]].sum(axis="columns") / tracked)):
            systems = {system: values[runs["system"] == system].to_numpy() for system in ("public", "gelslam")}
            for system, mine in systems.items():
                figures.update(median_and_range(f"{log}_{system}_{name}", mine))
            ratio = f"{log}_ratio" if name == "s" else f"{log}_frame_ratio"
            figures.update(mean_and_range(ratio, systems["public"] / systems["gelslam"]))
            figures[ratio] = figures[f"{log}_public_{name}"] / figures[f"{log}_gelslam_{name}"]
    logs = by_log({path.stem: read(path) for path in sorted((study / "errors").glob("*.json"))})
    figures.update(headline("optics", logs.loc[eight_objects(logs.index)]))
    figures.update(headline("track", logs.filter(like="track_", axis="index")))
    for n in ("scan_peanut360", "scan_pebblescan"):
        figures.update(of_scan(n, logs.loc[n]))
    shutil.copy(study / "side_by_side.png", CHARTS)
    return figures


PARTS = {"simulated": simulated, "accuracy": accuracy, "demo": demo, "stability": stability, "mechanisms": mechanisms, "calibration": calibration, "real": real, "live": live,
         "real_live": real, "followed": followed, "long": long, "growth": growth, "speed": speed, "public": public}


def draw(name, study):
    subprocess.run([ROOT / f"scripts/plot_{name}.py", study, "-o", CHARTS / f"{name}.png"], check=True, stdout=subprocess.DEVNULL)


def draw_real(out, figures):
    """A dot for each log: what is kept, and how often the pose moves without the picture."""
    figure, axis = plt.subplots(figsize=(6, 4))
    for label, part, mark, shade in (("offline", "real", "o", OURS), ("live", "real_live", "x", PUBLIC)):
        logs = by_log({path.stem: read(path) for path in sorted((out / part).glob("*.json"))})
        axis.plot(logs["kept"] / logs["touched"], 100 * logs["moved"] / logs["still"], mark, color=shade, label=label, alpha=0.8,
                  markerfacecolor="none", linestyle="")
    axis.set(xlabel="share of touched frames kept in the map", ylabel="still pictures whose pose moved (%)", ylim=(-0.5, None))
    axis.legend(loc="upper left")
    save(figure, CHARTS / "real.png")


def draw_chain(out, figures):
    """Processor time of the whole program against its error, offline, live and public."""
    figure, axis = plt.subplots(figsize=(6, 4))
    for label, path, mark, shade in (("offline", "accuracy/network.json", "o", OURS), ("live", "live/live.json", "x", COLORS["filterreg"])):
        tracks = by_log(read(out / path)).filter(like="track_", axis="index")
        axis.plot(1e3 * tracks["processor_s"] / tracks["frames.total"], tracks[ERROR], mark, color=shade, label=label, markerfacecolor="none")
    axis.plot(1e3 * figures["public"]["track_pebble_public_s"] / 245, figures["accuracy"]["track_public"], "s", color=PUBLIC,
              label="public system (mean error; time of one)")
    axis.set(xlabel="processor time of the whole program per frame (ms)", ylabel="pose error (mm)")
    logarithmic(axis, "x")
    logarithmic(axis, "y")
    axis.legend(loc="lower right")
    save(figure, CHARTS / "chain.png")


def draw_honesty(out, figures):
    """Wrong answers of each method that it calls right, and the errors of our poses over their stated sigma."""
    figure, (bars, curves) = plt.subplots(1, 2, figsize=(10, 3.8))
    wrong = {m: 100 * figures["stability"][m.replace("-", "_") + "_wrong"] for m in NAMES if m.replace("-", "_") + "_wrong" in figures["stability"]}
    bars.barh([NAMES[m] for m in wrong], list(wrong.values()), color=list(map(color, wrong)))
    bars.invert_yaxis()
    bars.set_xlabel("wrong but called right (% of the cases of the stability chart)")
    logs = by_log(read(out / "live/live.json"))
    for label, some, style in (("offline", by_log(read(out / "accuracy/network.json")).loc[logs.index], "-"), ("live", logs, "--")):
        ratios = np.sort(some["error_over_sigma"].explode().astype(float))
        curves.plot(ratios, np.linspace(0, 1, len(ratios)), style, label=label)
    x = np.linspace(0, 3, 200)
    curves.plot(x, chi2.cdf(6 * x * x, 6), ":", color="black", label="as stated")
    curves.set(xlim=(0, 3), xlabel="error / stated sigma", ylabel="share of the frames")
    curves.legend()
    save(figure, CHARTS / "honesty.png")


JOINT = ((draw_chain, {"accuracy", "live", "public"}), (draw_honesty, {"accuracy", "live", "stability"}), (draw_real, {"real", "real_live"}))


def commits(results):
    """The commit, and those of parts that were not measured with it."""
    newest = statistics.mode(r["commit"] for r in results.values())
    others = [f"{part}: {r['commit']}" for part, r in results.items() if r["commit"] != newest]
    return newest + (f" ({', '.join(others)})" if others else "")


def filled(template, results):
    """The page that a template gives. Throws KeyError for a figure that the results do not have."""
    known = {"commits": commits(results), "left_out": left_out(), "simulated": table_of_simulated(results["simulated"]["figures"])}
    for part, result in results.items():
        known.update({f"{part}.{name}": value for name, value in result["figures"].items()})
        known.update({f"{part}.{name}": result.get(name) for name in ("machine", "checksum")})

    def text(match):
        if match[1]:
            return match[2]
        value = known[match[2]]
        return MISSING if value is None else f"{value:.{match[3]}f}" if match[3] else value
    return NOT_MEASURED.sub("", FIELD.sub(text, template)).replace(MISSING, "–")


def measure(out, results):
    """Sets the parts that scripts/results.sh has measured into the folder `out`."""
    there = {path.parent.name for path in out.glob("*/commit")}
    for part in (p for p in PARTS if p in there):
        figures = {k: float(f"{v:.5g}") for k, v in PARTS[part](out / part).items()}
        results[part] = {"commit": (out / part / "commit").read_text().strip(), "machine": (out / part / "machine").read_text().strip(),
                         "figures": figures}
        if (out / part / "checksum").exists():
            results[part]["checksum"] = (out / part / "checksum").read_text().strip()
    FILE.write_text(json.dumps(results, indent=1) + "\n")
    plot_ablation.draw(pd.read_csv(CHARTS / "left_out.csv").assign(model="network"), CHARTS / "ablation.png")
    for draw_chart, parts in JOINT:
        if parts <= there:
            draw_chart(out, {part: r["figures"] for part, r in results.items()})
    print(FILE)


if __name__ == "__main__":
    if len(sys.argv) > 2 or sys.argv[-1].startswith("-"):
        sys.exit(__doc__)
    results = read(FILE) if FILE.exists() else {}
    if len(sys.argv) == 2:
        measure(pathlib.Path(sys.argv[1]), results)
    for page, template in PAGES.items():
        (ROOT / page).write_text(filled((ROOT / template).read_text(), results))
