#!/usr/bin/env bash
# usage: scripts/side_by_side.sh PUBLIC OUT LOG...
#
# Times whole offline reconstructions and their stages of the public Python system and of gelslam: both on one core, in
# turn, on the same logs. Prints a table of medians and ratios (scripts/plot_side_by_side.py) and draws a chart.
# PUBLIC: see scripts/public_system.sh.
#
# Example: scripts/side_by_side.sh PUBLIC OUT DATA/sequences/track_pebble DATA/optics/optics_tread9
. "$(dirname "$0")/common.sh"

parse "" 3 1000 "$@"
public=${arguments[0]} out=${arguments[1]}
repetitions=${REPETITIONS:-3} core=${CORE:-$(($(nproc) - 1))} gelslam=${GELSLAM_PROGRAM:-$root/build/bin/gelslam}
[[ -n ${GELSLAM:-} || -d $public/gelslam ]] || fail "$public: no checkouts of the public system; see scripts/public_system.sh"
[[ -x $gelslam ]] || fail "$gelslam: not built; see scripts/build.sh"
mkdir -p "$out"
echo "system,log,repetition,processor_s" >"$out/runs.csv"

TIMEFORMAT='%U %S'
exec 3>&2
timed() {  # system, log, repetition, command...
  local used status=0
  used=$({ time OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 taskset -c "$core" "${@:4}" >/dev/null 2>&3; } 2>&1) || status=$?
  # The program's exit code 1 is a poor result; Python's is that of an exception.
  ((status == 0)) || [[ $1$status == gelslam1 ]] || { say "the run $1,$2,$3 failed" >&2; exit 1; }
  awk -v row="$1,$2,$3" '{ printf "%s,%.3f\n", row, $1 + $2 }' <<<"$used" >>"$out/runs.csv"
}

for log in "${arguments[@]:2}"; do
  name=$(basename "$log")
  for ((i = 1; i <= repetitions; ++i)); do
    echo "$name $i of $repetitions" >&2
    timed public "$name" "$i" "$root/scripts/public_system.sh" "$public" "$out/public-$i" "$log"
    timed gelslam "$name" "$i" "$gelslam" reconstruct "$log" -o "$out/gelslam-$i/$name" --overwrite -q
  done
done
"$root/scripts/plot_side_by_side.py" "$out"
