#!/usr/bin/env bash
# Makes the API reference: see usage below.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

case ${1:-} in
  -*)
    echo "usage: scripts/api_reference.sh [OUT]"
    echo "Makes web pages of the public C++ headers in OUT/html (default build/api). A warning of Doxygen is an error."
    [[ $1 == -h || $1 == --help ]] && exit 0 || exit 2
    ;;
esac
out=$(realpath -m "${1:-$root/build/api}")

"$root/scripts/setup.sh" --reference
mkdir -p "$out"
cd "$root"
{
  cat packaging/Doxyfile
  echo "OUTPUT_DIRECTORY = \"$out\""
} | doxygen -
echo "api_reference: $out/html/index.html"
