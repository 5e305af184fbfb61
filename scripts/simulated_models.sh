#!/usr/bin/env bash
# Makes the models of the simulated sensor that `gelslam simulate scan` writes beside a scan: see usage below.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
gelslam=${1:-$root/build/bin/gelslam}
if [[ $gelslam == -* || ! -x $gelslam ]]; then
  echo "usage: scripts/simulated_models.sh [PROGRAM [DIR [OPTICS]]]    makes libs/simulation/models/{mini,flat}.json, in minutes;" >&2
  echo "       or DIR/OPTICS.json, and the same in the public format, DIR/OPTICS.pth" >&2
  exit 2
fi
out=${2:-$root/libs/simulation/models}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for optics in ${3:-mini flat}; do
  for diameter in 6.31 9.5; do
    "$gelslam" simulate presses --optics "$optics" --diameter "$diameter" --presses 90 -o "$work/$optics.$diameter" -q
    "$gelslam" calibrate collect "$work/$optics.$diameter" -o "$work/$optics" --diameter "$diameter" --presses 90 --headless -q ||
      (($? == 1))  # some presses were not taken
  done
  "$gelslam" calibrate train "$work/$optics" -o "$out/$optics.json" ${2:+--pth "$out/$optics.pth"} --overwrite -q
done
