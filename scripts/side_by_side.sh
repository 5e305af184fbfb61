#!/usr/bin/env bash
# Times whole offline reconstructions and their stages of the public Python system and of gelslam: both on one core, in
# turn, on the same logs. Prints a table of medians and ratios (scripts/plot_side_by_side.py) and draws a chart.
# PUBLIC: see scripts/public_system.sh.
#
# Example: scripts/side_by_side.sh PUBLIC OUT DATA/sequences/track_pebble DATA/optics/optics_tread9
set -euo pipefail
cd "$(dirname "$0")/.."

usage() { sed -n '2,6s/^# \?//p' "$0" >&2; exit 2; }
(($# >= 3)) || usage
public=$1 out=$2
shift 2
repetitions=${REPETITIONS:-3} core=${CORE:-$(($(nproc) - 1))} gelslam=${GELSLAM_PROGRAM:-build/bin/gelslam}
[[ -f $public/run_reference.py ]] || { echo "$public: no run_reference.py" >&2; exit 2; }
[[ -x $gelslam ]] || { echo "$gelslam: not built; see scripts/build.sh" >&2; exit 2; }
mkdir -p "$out"
echo "system,log,repetition,processor_s" >"$out/runs.csv"

# The public system takes no relative path of a model.
with_absolute_model() {
  local folder=$out/logs/$(basename "$1")
  mkdir -p "$folder"
  ln -sf "$(realpath "$1")"/* "$folder"
  rm "$folder/config.yaml"
  python3 - "$1" >"$folder/config.yaml" <<'P'
import pathlib, re, sys
log = pathlib.Path(sys.argv[1])
name = re.compile(r'(calibration_model_path: *)"?([^"\n]+)"?')
print(name.sub(lambda m: f'{m[1]}"{(log / m[2]).resolve()}"', (log / "config.yaml").read_text()))
P
  echo "$folder"
}

timed() {  # system, log, repetition, command...
  local row=$1,$(basename "$2"),$3
  shift 3
  OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python3 - "$out/runs.csv" "$row" "$@" <<'P'
import os, resource, subprocess, sys
ended = subprocess.run(["taskset", "-c", os.environ["CORE"], *sys.argv[3:]], stdout=subprocess.DEVNULL, env=os.environ)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
poor = sys.argv[2].startswith("gelslam,")  # its exit code 1; Python's is that of an exception
if ended.returncode not in (0, int(poor)): sys.exit(f"the run {sys.argv[2]} failed")
open(sys.argv[1], "a").write(f"{sys.argv[2]},{used.ru_utime + used.ru_stime:.3f}\n")
P
}

export CORE=$core
for log in "$@"; do
  folder=$(with_absolute_model "$log")
  for ((i = 1; i <= repetitions; ++i)); do
    echo "$(basename "$log") $i of $repetitions" >&2
    timed public "$log" "$i" scripts/public_system.sh "$public" "$out/public-$i" "$folder"
    timed gelslam "$log" "$i" "$gelslam" reconstruct "$folder" -o "$out/gelslam-$i/$(basename "$log")" --overwrite -q
  done
done
scripts/plot_side_by_side.py "$out"
