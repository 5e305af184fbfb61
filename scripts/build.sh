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
. "$(dirname "$0")/common.sh"

no_install='' lab='' python='' tests=''
parse "--no-install --lab --python --tests" 0 2 "$@"
dir=$(realpath -m "${arguments[0]:-$root/build}")
"$root/scripts/setup.sh" ${no_install:+--no-install} ${lab:+--tests} ${tests:+--tests} ${python:+--python}

options=() targets=(gelslam_app)
[[ -z $lab ]] || options+=(-DGELSLAM_BUILD_LAB=ON) targets+=(gelslam_lab_app)
if [[ -n $tests ]]; then
  options+=(-DGELSLAM_BUILD_TESTS=ON) targets=(all)
  if /usr/bin/python3 -c 'import pybind11, numpy' 2>/dev/null; then
    python=true
  else
    say "no pybind11 (scripts/setup.sh --python): the Python module is neither built nor tested"
  fi
fi
[[ -z $python ]] || options+=(-DGELSLAM_BUILD_PYTHON=ON) targets+=(gelslam_python)

generator=()
if [[ ! -f $dir/CMakeCache.txt ]] && command -v ninja >/dev/null; then generator=(-G Ninja); fi

say "configuring $dir"
cmake -S "$root" -B "$dir" "${generator[@]}" -DCMAKE_BUILD_TYPE=Release -DGELSLAM_WERROR="${GELSLAM_WERROR:-OFF}" "${options[@]}"

# A compiler takes up to 1.5 GB. More jobs than memory would be slower than fewer.
jobs=$(nproc)
memory_jobs=$(awk '/MemAvailable/ { print int($2 / 1500000) }' /proc/meminfo 2>/dev/null || echo "$jobs")
if ((memory_jobs < jobs)); then jobs=$((memory_jobs > 0 ? memory_jobs : 1)); fi

say "compiling with $jobs jobs"
((${#arguments[@]} < 2)) || targets=("${arguments[1]}")
cmake --build "$dir" --parallel "$jobs" --target "${targets[@]}"
say "the program is $dir/bin/gelslam"
