#!/usr/bin/env bash
# usage: scripts/reproduce_paper.sh [--methods LIST] [-o OUT] TACTILETRACKING_DIR [GELSLAM_DIR]
#
# Repeats the tracking experiment of the NormalFlow paper (RA-L 2024, Fig. 5) on the TactileTracking data: every frame is
# registered to the first one, by NormalFlow, ICP, FPFH and FilterReg. Prints mean absolute errors per object and method,
# and their mean over the objects beside the published one. With GELSLAM_DIR it also reconstructs every log in there,
# evaluates those that have a ground truth, and tracks these by all methods, too, each with keyframes.
#
# TACTILETRACKING_DIR holds one folder per trial (avocado0, avocado1, ...) with gradient_maps.npy, contact_masks.npy and
# true_start_T_currs.npy or true_transforms.npy. Both data sets are at huggingface.co/datasets/joehjhuang.
#
#   --methods LIST   default normalflow,icp,fpfh,filterreg; all 84 trials take hours, most of them for FPFH
#   -o OUT           folder for tables, pictures and runs (default: paper in the repository)
#
# The program is built if GELSLAM_BIN does not name a folder with gelslam and gelslam-lab.
. "$(dirname "$0")/common.sh"

methods=normalflow,icp,fpfh,filterreg o=$root/paper
parse "--methods= -o=" 1 2 "$@"
out=$o folders=("${arguments[@]}")
for folder in "${folders[@]}"; do
  [[ -d $folder ]] || fail "there is no folder $folder"
done

bin=${GELSLAM_BIN:-$root/build/bin}
[[ -n ${GELSLAM_BIN:-} ]] || "$root/scripts/build.sh" --lab
mkdir -p "$out"

echo "tracking: ${folders[0]}"
"$bin/gelslam-lab" benchmark "${folders[0]}" --methods "$methods" -o "$out/tracking" >"$out/tracking.txt"
cat "$out/tracking.txt"
"$root/scripts/plot_benchmark.py" "$out/tracking" >/dev/null || say "no pictures without matplotlib" >&2
python3 - "$out/tracking/accuracy.json" <<'END'
import json, statistics, sys

AXES = ("x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg")
PUBLISHED = {  # mean over ten objects, sensor pose against motion capture; the last column is the runtime in ms
    "normalflow": (0.17, 0.18, 0.15, 1.13, 1.42, 0.64, 13.9),
    "filterreg": (0.85, 1.05, 0.20, 1.96, 2.59, 15.4, 145),
    "icp": (1.22, 3.44, 0.85, 2.27, 3.30, 15.9, 13.6),
    "fpfh": (2.38, 1.69, 1.26, 2.93, 36.8, 27.8, 127),
}
SYMMETRIC = {"ball", "cylinder"}  # they do not show every rotation

rows = [r for r in json.load(open(sys.argv[1])) if r["object"] != "all"]
print("\n%-42s" % "mean over objects" + "".join("%9s" % a.replace("_", " ") for a in AXES) + "%9s" % "ms")
for method in dict.fromkeys(r["method"] for r in rows):
    own = [r for r in rows if r["method"] == method]
    others = [r for r in own if r["object"] not in SYMMETRIC]
    lines = {f"all {len(own)}": own, f"{len(others)} without {' and '.join(sorted(SYMMETRIC))}": others if others != own else []}
    means = {name: [statistics.fmean(r[k] for r in some) for k in (*AXES, "median_ms")] for name, some in lines.items() if some}
    for name, values in {**means, "published": PUBLISHED.get(method, ())}.items():
        if values:
            print("%-42s" % f"{method}, {name}" + "".join("%9.3f" % v for v in values))
END

((${#folders[@]} == 2)) || exit 0
failed=0 with_truth=()
while IFS= read -r -d '' log; do
  folder=$(dirname "$log")
  name=$(realpath --relative-to="${folders[1]}" "$folder" | tr / _)
  echo
  echo "reconstruction: $folder"
  "$bin/gelslam" reconstruct "$folder" -o "$out/runs/$name" --overwrite -q || { failed=1; continue; }
  "$bin/gelslam" info "$out/runs/$name"
  if [[ -f $folder/true_start_T_currs.npy || -f $folder/true_transforms.npy ]]; then
    with_truth+=("$folder")
    "$bin/gelslam" evaluate "$out/runs/$name" --truth "$folder" || failed=1
  fi
done < <(find "${folders[1]}" -name gelsight.avi -print0 | sort -z)
if ((${#with_truth[@]} > 0)); then
  echo
  echo "tracking with keyframes: ${#with_truth[@]} logs of ${folders[1]}"
  "$bin/gelslam-lab" benchmark "${with_truth[@]}" --protocol keyframes --methods "$methods" -o "$out/gelslam" || failed=1
fi
exit $failed
