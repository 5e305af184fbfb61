#!/usr/bin/env bash
# usage: scripts/build.sh [--no-install] [--lab] [--python] [--tests] [DIR [TARGET]]
#
# Installs what is missing (scripts/setup.sh) and builds into DIR, default: build in the repository; a relative DIR counts
# from the current folder. The program is then DIR/bin/gelslam.
#   --no-install   do not install packages; stop if some are missing
#   --lab          build gelslam-lab, too
#   --python       build the Python module, too: PYTHONPATH=DIR/python
#   --tests        build the tests and, where pybind11 is installed, the Python module, too
# GELSLAM_WERROR=ON makes warnings errors.
set -euo pipefail

usage() { sed -n '2,/^set /s/^# \?//p' "$0"; }

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

setup=() tests=false python=false
options=() targets=(gelslam_app)
while [[ ${1:-} == -* ]]; do
  case $1 in
    --no-install) setup+=(--no-install) ;;
    --lab) options+=(-DGELSLAM_BUILD_LAB=ON) targets+=(gelslam_lab_app) ;;
    --python) python=true ;;
    --tests) tests=true options+=(-DGELSLAM_BUILD_TESTS=ON) targets=(all) ;;
    -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
  shift
done
(($# <= 2)) || { usage >&2; exit 2; }
dir=$(realpath -m "${1:-$root/build}")
((${#options[@]} == 0)) || setup+=(--tests)
! $python || setup+=(--python)

"$root/scripts/setup.sh" "${setup[@]}"

if $tests && ! $python; then
  if /usr/bin/python3 -c 'import pybind11, numpy' 2>/dev/null; then
    python=true
  else
    echo "build: no pybind11 (scripts/setup.sh --python): the Python module is neither built nor tested"
  fi
fi
if $python; then
  options+=(-DGELSLAM_BUILD_PYTHON=ON)
  targets+=(gelslam_python)
fi

generator=()
if [[ ! -f $dir/CMakeCache.txt ]] && command -v ninja >/dev/null; then generator=(-G Ninja); fi

echo "build: configuring $dir"
cmake -S "$root" -B "$dir" "${generator[@]}" -DCMAKE_BUILD_TYPE=Release -DGELSLAM_WERROR="${GELSLAM_WERROR:-OFF}" "${options[@]}"

# A compiler takes up to 1.5 GB. More jobs than memory would be slower than fewer.
jobs=$(nproc)
memory_jobs=$(awk '/MemAvailable/ { print int($2 / 1500000) }' /proc/meminfo 2>/dev/null || echo "$jobs")
if ((memory_jobs < jobs)); then jobs=$((memory_jobs > 0 ? memory_jobs : 1)); fi

echo "build: compiling with $jobs jobs"
[[ -z ${2:-} ]] || targets=("$2")
cmake --build "$dir" --parallel "$jobs" --target "${targets[@]}"
echo "build: the program is $dir/bin/gelslam"
