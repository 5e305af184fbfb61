#!/usr/bin/env bash
# usage: scripts/test.sh [--no-install] [DIR]
#
# Builds the program, the laboratory and the tests as scripts/build.sh does, and runs the tests. Tests on real data look
# for it in GELSLAM_DATA (default: ../shared/data beside the repository). Where there is none they are skipped, and the
# last line says how many.
. "$(dirname "$0")/common.sh"

no_install=
parse --no-install 0 1 "$@"
dir=$(realpath -m "${arguments[0]:-$root/build}")
"$root/scripts/build.sh" ${no_install:+--no-install} --lab --tests "$dir"

say "running the tests in $dir"
result=0
ctest --test-dir "$dir" --output-on-failure -j2 || result=$?
without_data=$(grep -c 'set GELSLAM_DATA' "$dir/Testing/Temporary/LastTest.log" || true)
((without_data == 0)) || say "$without_data tests on real data did not run; set GELSLAM_DATA"
exit "$result"
