#!/usr/bin/env bash
# Sets up, builds and tests. Usage: scripts/test.sh [DIR]; DIR as for build.sh. Tests on real data look for it in
# GELSLAM_DATA (default: ../shared/data beside the repository) and are skipped where there is none.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
"$root/scripts/build.sh" "$@"
dir=${1:-$root/build}

echo "test: running the tests in $dir"
exec ctest --test-dir "$dir" --output-on-failure -j2
