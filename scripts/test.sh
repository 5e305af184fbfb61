#!/usr/bin/env bash
# Builds the program, the laboratory and the tests, and runs the tests. Usage: scripts/test.sh [--no-install] [DIR], as for
# build.sh. Tests on real data look for it in GELSLAM_DATA (default: ../shared/data beside the repository); they are
# skipped where there is none.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
options=(--lab --tests)
if [[ ${1:-} == --no-install ]]; then
  options+=(--no-install)
  shift
fi
if [[ ${1:-} == -* || $# -gt 1 ]]; then
  echo "usage: scripts/test.sh [--no-install] [DIR]" >&2
  exit 2
fi
"$root/scripts/build.sh" "${options[@]}" "$@"
dir=${1:-$root/build}

echo "test: running the tests in $dir"
exec ctest --test-dir "$dir" --output-on-failure -j2
