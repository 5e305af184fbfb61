#!/usr/bin/env bash
# Builds everything, or only one target. Usage: scripts/build.sh [DIR [TARGET]]; the program is then DIR/bin/gelslam
# (default DIR: build in the repository; a relative DIR counts from where you are). GELSLAM_WERROR=ON makes warnings errors.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
if [[ ${1:-} == -* || $# -gt 2 ]]; then
  echo "usage: scripts/build.sh [DIR [TARGET]]" >&2
  exit 2
fi
dir=${1:-$root/build}
[[ $dir == /* ]] || dir=$PWD/$dir

"$root/scripts/setup.sh"

generator=()
if [[ ! -f $dir/CMakeCache.txt ]] && command -v ninja >/dev/null; then generator=(-G Ninja); fi

echo "build: configuring $dir"
cmake -S "$root" -B "$dir" "${generator[@]}" -DCMAKE_BUILD_TYPE=Release -DGELSLAM_WERROR="${GELSLAM_WERROR:-OFF}"

# Some files need more than 1 GB to compile: more jobs than memory would be slower than fewer.
jobs=$(nproc)
memory_jobs=$(awk '/MemAvailable/ { print int($2 / 1500000) }' /proc/meminfo 2>/dev/null || echo "$jobs")
if ((memory_jobs < jobs)); then jobs=$((memory_jobs > 0 ? memory_jobs : 1)); fi

echo "build: compiling with $jobs jobs"
cmake --build "$dir" --parallel "$jobs" --target "${2:-all}"
echo "build: the program is $dir/bin/gelslam"
