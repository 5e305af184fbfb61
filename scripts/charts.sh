#!/usr/bin/env bash
# usage: scripts/charts.sh [--quick] DATA [OUT]
#
# Builds gelslam and gelslam-lab, runs the studies on the sequences in DATA/sequences and draws them. Takes hours; --quick
# takes fewer cases and is good for a first look. The tables stay in OUT/STUDY (default OUT: charts in the repository), the
# charts are:
#   accuracy.png speed_accuracy.png stability.png long_scan.png ablation.png
#   frame0/ and keyframes/: tables and pictures of the two protocols; protocols.txt: both tables
#   localization.txt, speed.txt, pose_graph.txt, soak.txt: the other tables
set -euo pipefail

usage() { sed -n '2,/^set /s/^# \?//p' "$0"; }

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

quick=()
[[ ${1:-} != --quick ]] || { quick=(--quick); shift; }
case ${1:-} in
  -h | --help) usage; exit 0 ;;
  "" | -*) usage >&2; exit 2 ;;
esac
data=$(cd "$1" && pwd -P)
out=$(realpath -m "${2:-$root/charts}")
export GELSLAM_DATA=$data  # of check_sequences.py
lab=$root/build/bin/gelslam-lab

"$root/scripts/build.sh" --lab "$root/build"
mkdir -p "$out"
sequences=("$data"/sequences/track_*)
few=("$data"/sequences/{track,hard,scan}_*) every=() accurate=() frames=45000 trials=100 minutes=10
mechanisms=("$data/sequences" "$data/ablation")
if ((${#quick[@]} > 0)); then
  sequences=("${sequences[@]:0:2}")
  every=(--every 10)
  few=("${sequences[@]}" --most-references 4)
  accurate=("${sequences[@]##*/}" scan_peanut360)
  frames=2000 trials=5 minutes=0.5
  mechanisms=("${sequences[@]}")
fi

say() { echo "charts: $*"; }
table() {  # name, command
  say "$1"
  "${@:2}" | tee "$out/$1.txt"
}
draw() { "$root/scripts/plot_$1.py" "${@:3}" -o "$out/$2"; }

say "accuracy"
# 1: a target is missed
"$root/scripts/check_sequences.py" "${accurate[@]}" --out "$out/runs" --json "$out/accuracy.json" || (($? == 1))
draw accuracy accuracy.png "$out/accuracy.json"

say "speed against accuracy"
"$lab" speed-accuracy "${few[@]}" --slow-every 12 -o "$out/speed_accuracy"
draw speed_accuracy speed_accuracy.png "$out/speed_accuracy"

say "stability"
"$lab" stability "${sequences[@]}" "${quick[@]}" -o "$out/stability"
draw stability stability.png "$out/stability"

say "what each mechanism is worth"
"$lab" ablation "${mechanisms[@]}" -o "$out/ablation" >/dev/null
draw ablation ablation.png "$out/ablation"

say "a long scan"
"$lab" long-scan --frames "$frames" -o "$out/long_scan"
draw long_scan long_scan.png "$out/long_scan"

table localization "$lab" localize --trials "$trials" -o "$out/localize"
table speed "$lab" micro-benchmarks frame_from_picture_to_pose
table pose_graph "$lab" micro-benchmarks backend/solve
table soak "$lab" soak "$data/sequences/track_coin" --minutes "$minutes"

say "protocols"
: >"$out/protocols.txt"
for protocol in frame0 keyframes; do
  methods=normalflow,icp,icp-tuned,filterreg,filterreg-tuned
  "$lab" benchmark "${sequences[@]}" "${every[@]}" --protocol "$protocol" --methods "$methods" -o "$out/$protocol" |
    tee -a "$out/protocols.txt"
  "$root/scripts/plot_benchmark.py" "$out/$protocol"
done
"$lab" benchmark "${sequences[@]}" --methods fpfh,fpfh-tuned --every "${every[1]:-4}" -o "$out/fpfh" |
  tee -a "$out/protocols.txt"
say "done: $out"
