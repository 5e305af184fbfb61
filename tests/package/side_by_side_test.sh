#!/usr/bin/env bash
# A public system that ends with 1, as Python does where a module is missing, was not timed.
# usage: side_by_side_test.sh SIDE_BY_SIDE_SH
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work"/public/{normalflow,gs_sdk,gelslam} "$work/log"  # checkouts without modules
echo 'calibration_model_path: model.pth' >"$work/log/config.yaml"
if GELSLAM_PROGRAM=/bin/true REPETITIONS=1 "$1" "$work/public" "$work/out" "$work/log" 2>"$work/said"; then
  echo "a run that failed was taken" >&2
  exit 1
fi
grep -q 'the run public,log,1 failed' "$work/said" || { cat "$work/said" >&2; exit 1; }
[[ $(wc -l <"$work/out/runs.csv") == 1 ]]  # only the heading
