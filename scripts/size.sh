#!/usr/bin/env bash
# usage: scripts/size.sh [DIR]
#
# Prints yardsticks of the checkout in DIR (default: this one), so that two states can be compared:
#   lines        .cpp and .hpp of libs and apps/gelslam
#   settings     what changes a result, in the chain from surface to fusion and slam: constants (constexpr at any scope, or
#                const with a k name) and fields of structs named *Options and *Limits. Not counted: what follows from
#                other constants, text, file formats and their bounds, what judges a background in words, queues and
#                intervals of live scans, and structs within structs
#   short files  .cpp and .hpp files of less than 40 lines, everywhere
#   words        in README.md and docs/*.md, docs/*/*.md
. "$(dirname "$0")/common.sh"

parse "" 0 1 "$@"
cd "${arguments[0]:-$root}"

chain=(libs/surface libs/registration libs/frontend libs/loop_closure libs/backend libs/fusion libs/slam)

lines_of() { find "$@" \( -name '*.cpp' -o -name '*.hpp' \) -exec cat {} + 2>/dev/null | wc -l; }
row() { printf '%-52s %8s\n' "$1" "$2"; }

# Without formats, and what only a live scan has.
read -r constants fields < <(find "${chain[@]}" \( -name '*.cpp' -o -name '*.hpp' \) 2>/dev/null |
  grep -vE '/slam/src/(live|stream|run_folder)/|/(live_[a-z]+|packed_surface|model_file|gradient_model|pickle_reader|pth_(reader|writer)|scan_record|background_judgement)[.]' |
  xargs awk '
  FNR == 1 || /^};/ { inside = 0 }
  /^struct [A-Za-z]*(Options|Limits)( |$|\{)/ { inside = 1; next }
  { sub(/\/\/.*/, "") }
  /^ *(inline |static )*constexpr [^(]*( |\])?k?[A-Za-z_0-9]+(\[[^]]*\])* *[={;]/ || /^(inline |static )*const [^(]* k[A-Z][A-Za-z0-9]*(\[[^]]*\])* *[={;(]/ {
    if (/= *$/ && (getline more) > 0) $0 = $0 more
    value = $0
    if (/char *\*|string_view/ || !sub(/^[^={]*[={]/, "", value)) next
    gsub(/, *k[A-Z][A-Za-z0-9]* *=/, ",", value)  # the next constant of the line
    if (value ~ /(^|[^A-Za-z_])k[A-Z]/ || value ~ /numeric_limits|numbers::/) next
    gsub(/[({][^(){}]*[)}]/, "")   # values may hold commas
    constants += 1 + gsub(/, *k[A-Z]/, "")
    next
  }
  inside && /^  [A-Za-z][^()]*;/ && !/^  (using|static|friend|return) / && !/^  [A-Za-z]*(Options|Limits|Optics) / {
    gsub(/[({][^(){}]*[)}]/, "")
    fields += 1 + gsub(/, *[a-z]/, "")
  }
  END { print constants + 0, fields + 0 }')

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
