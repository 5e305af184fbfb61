#!/usr/bin/env bash
# usage: scripts/api_reference.sh [OUT]
#
# Makes web pages of the public C++ headers in OUT/html (default build/api). A warning of Doxygen is an error.
. "$(dirname "$0")/common.sh"

parse "" 0 1 "$@"
out=$(realpath -m "${arguments[0]:-$root/build/api}")

"$root/scripts/setup.sh" --reference
mkdir -p "$out"
cd "$root"
{ cat packaging/Doxyfile && echo "OUTPUT_DIRECTORY = \"$out\""; } | doxygen -
say "$out/html/index.html"
