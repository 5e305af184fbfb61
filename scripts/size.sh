#!/usr/bin/env bash
# usage: scripts/size.sh [DIR]
#
# Prints yardsticks of the checkout in DIR (default: this one), so that two states can be compared:
#   lines        .cpp and .hpp of libs and apps/gelslam
#   settings     what changes a result, in the chain from surface to fusion and slam: constants (constexpr at any scope, or
#                const with a k name) and fields of structs named *Options and *Limits. Not counted: what follows from
#                other constants, text, file formats and their bounds, what judges a background in words, queues and
#                intervals of live scans, structs within structs, and what a comment marks, by its first word:
#                numerics (iterations, kernel radii, sampling), layout, bound (of input), speed, message
#   short files  .cpp and .hpp files of less than 40 lines, everywhere
#   words        in README.md and docs/*.md, docs/*/*.md
set -euo pipefail

usage() { sed -n '2,/^set /s/^# \?//p' "$0"; }

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

case ${1:-} in
  -h | --help) usage; exit 0 ;;
  -*) usage >&2; exit 2 ;;
esac
cd "${1:-$root}"

chain=(libs/surface libs/registration libs/frontend libs/loop_closure libs/backend libs/fusion libs/slam)

# Files of these folders, one per line.
sources() {
  find "$@" \( -name '*.cpp' -o -name '*.hpp' \) 2>/dev/null || true
}
lines_of() { sources "$@" | tr '\n' '\0' | xargs -0 -r cat | wc -l; }
row() { printf '%-52s %8s\n' "$1" "$2"; }

marked='//[/<!]* (numerics|layout|bound|speed|message)(:|$)'

# Formats, and what only a live scan has.
chain_sources() {
  sources "${chain[@]}" | grep -vE '/slam/src/(live|stream|run_folder)/|/(live_[a-z]+|packed_surface|model_file|gradient_model|pickle_reader|pth_(reader|writer)|scan_record|background_judgement)[.]'
}
constants=$(chain_sources | tr '\n' '\0' | xargs -0 -r awk -v marked="$marked" '
  /^ *(inline |static )*constexpr [^(]*( |\])?k?[A-Za-z_0-9]+(\[[^]]*\])* *[={;]/ || /^(inline |static )*const [^(]* k[A-Z][A-Za-z0-9]*(\[[^]]*\])* *[={;(]/ {
    line = $0
    if (line ~ marked) next
    sub(/\/\/.*/, "", line)
    if (line ~ /= *$/ && (getline more) > 0) line = line more
    value = line
    if (line ~ /char *\*|string_view/ || !sub(/^[^={]*[={]/, "", value)) next
    gsub(/, *k[A-Z][A-Za-z0-9]* *=/, ",", value)  # the next constant of the line
    if (value ~ /(^|[^A-Za-z_])k[A-Z]/ || value ~ /numeric_limits|numbers::/) next
    gsub(/[({][^(){}]*[)}]/, "", line)   # values may hold commas
    count += 1 + gsub(/, *k[A-Z]/, "", line)
  }
  END { print count + 0 }')
fields=$(chain_sources | tr '\n' '\0' | xargs -0 -r awk -v marked="$marked" '
  FNR == 1 { inside = 0 }
  /^struct [A-Za-z]*(Options|Limits)( |$|\{)/ { inside = 1; next }
  inside && /^};/ { inside = 0 }
  inside && /^  [A-Za-z][^()]*;/ && !/^  (using|static|friend|return) / && !/^  [A-Za-z]*(Options|Limits|Optics) / {
    line = $0
    if (line ~ marked) next
    sub(/\/\/.*/, "", line)
    gsub(/[({][^(){}]*[)}]/, "", line)
    count += 1 + gsub(/, *[a-z]/, "", line)
  }
  END { print count + 0 }')

row "lines, libs and apps/gelslam" "$(lines_of libs apps/gelslam)"
for part in libs/* apps/*; do
  [[ ! -d $part ]] || row "  $part" "$(lines_of "$part")"
done
row "lines, tests" "$(lines_of tests)"
row "settings from surface to fusion" "$((constants + fields))"
row "  constants" "$constants"
row "  option fields" "$fields"
row "files of less than 40 lines" "$(find libs apps tests \( -name '*.cpp' -o -name '*.hpp' \) -exec awk 'END { if (NR < 40) print FILENAME }' {} \; | wc -l)"
row "words in README.md and docs" "$(find README.md docs -name '*.md' -print0 | xargs -0 cat | wc -w)"
