#!/usr/bin/env bash
# usage: scripts/test.sh [--no-install] [DIR]
#
# Builds the program, the laboratory and the tests as scripts/build.sh does, and runs the tests. Tests on real data look
# for it in GELSLAM_DATA (default: ../shared/data beside the repository). Where there is none they are skipped, and the
# last line says how many.
set -euo pipefail

usage() { sed -n '2,/^set /s/^# \?//p' "$0"; }

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
options=(--lab --tests)
[[ ${1:-} != --no-install ]] || { options+=(--no-install); shift; }
[[ ${1:-} != -* && $# -le 1 ]] || { usage >&2; exit 2; }
dir=$(realpath -m "${1:-$root/build}")
"$root/scripts/build.sh" "${options[@]}" "$dir"

echo "test: running the tests in $dir"
result=0
ctest --test-dir "$dir" --output-on-failure -j2 || result=$?
without_data=$(grep -c 'set GELSLAM_DATA' "$dir/Testing/Temporary/LastTest.log" || true)
((without_data == 0)) || echo "test: $without_data tests on real data did not run; set GELSLAM_DATA"
exit "$result"
