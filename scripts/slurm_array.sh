#!/usr/bin/env bash
# One log per task of a Slurm array: line SLURM_ARRAY_TASK_ID of LIST is reconstructed into RUNS/<name of the log>.
#   ls -d data/*/ > logs.txt
#   sbatch --array=1-$(wc -l < logs.txt)%50 scripts/slurm_array.sh logs.txt runs [--model nnmodel.pth ...]
# Submit it again after failures or a time limit: finished logs are skipped, and a task that was stopped begins anew.
#SBATCH --job-name=gelslam
#SBATCH --cpus-per-task=2
#SBATCH --mem=2G
#SBATCH --time=01:00:00
#SBATCH --signal=B:INT@120
#SBATCH --output=slurm-%A_%a.out
set -euo pipefail

if [ $# -lt 2 ]; then
  echo "usage: sbatch --array=1-N slurm_array.sh LIST RUNS [options of gelslam reconstruct]" >&2
  exit 2
fi
list=$1 runs=$2
shift 2
task=${SLURM_ARRAY_TASK_ID:-}
if [ -z "$task" ]; then
  echo "slurm_array.sh: no SLURM_ARRAY_TASK_ID; submit it with sbatch --array=1-N" >&2
  exit 2
fi
log=$(sed -n "${task}p" "$list")
if [ -z "$log" ]; then
  echo "slurm_array.sh: $list has no line $task" >&2
  exit 2
fi
# The run is called like the log; gelsight.avi and log.mkv are called like their folder.
name=$log
case $(basename "$log") in gelsight.avi | log.mkv) name=$(dirname "$(realpath "$log")") ;; esac
name=$(basename "$name")
[ -d "$log" ] || name=${name%.*}
run=$runs/$name
if grep -q '"partial": false' "$run/report.json" 2>/dev/null; then
  echo "slurm_array.sh: $run is finished" >&2
  exit 0
fi
exec "${GELSLAM:-gelslam}" reconstruct --output "$run" --overwrite "$@" -- "$log"
