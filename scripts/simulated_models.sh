#!/usr/bin/env bash
# usage: scripts/simulated_models.sh [PROGRAM [DIR [OPTICS]]]
#
# Makes the models of the simulated sensor that `gelslam simulate scan` writes beside a scan, in minutes:
# libs/simulation/models/{mini,flat}.json; or DIR/OPTICS.json, and the same in the public format, DIR/OPTICS.pth.
. "$(dirname "$0")/common.sh"

parse "" 0 3 "$@"
gelslam=${arguments[0]:-$root/build/bin/gelslam} dir=${arguments[1]:-} optics=${arguments[2]:-}
[[ -x $gelslam ]] || fail "there is no program $gelslam"
out=${dir:-$root/libs/simulation/models}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for optics in ${optics:-mini flat}; do
  for diameter in 6.31 9.5; do
    "$gelslam" simulate presses --optics "$optics" --diameter "$diameter" --presses 90 -o "$work/$optics.$diameter" -q
    "$gelslam" calibrate collect "$work/$optics.$diameter" -o "$work/$optics" --diameter "$diameter" --presses 90 --headless -q ||
      (($? == 1))  # some presses were not taken
  done
  "$gelslam" calibrate train "$work/$optics" -o "$out/$optics.json" ${dir:+--pth "$out/$optics.pth"} --overwrite -q
done
