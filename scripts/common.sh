# Sourced by the scripts beside it, whose first comment is their usage.
set -euo pipefail

# shellcheck disable=SC2034  # of those who source this
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

say() { echo "$(basename "$0" .sh): $*"; }
fail() { say "$*" >&2; exit 2; }
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0"; }
misused() { usage >&2; exit 2; }

# parse "OPTION..." LEAST MOST "$@": --one-option sets one_option=true; an OPTION that ends with = takes a value. The other
# words become `arguments`.
parse() {
  local known=" $1 " least=$2 most=$3 name
  shift 3
  arguments=()
  while (($# > 0)); do
    name=${1##*--} name=${name#-} name=${name//-/_}
    case $1 in
      -h | --help) usage; exit 0 ;;
      -*)
        if [[ $known == *" $1 "* ]]; then
          declare -g "$name=true"
        elif [[ $known == *" $1= "* ]]; then
          declare -g "$name=${2:?$1 needs a value}"
          shift
        else
          misused
        fi
        ;;
      *) arguments+=("$1") ;;
    esac
    shift
  done
  ((${#arguments[@]} >= least && ${#arguments[@]} <= most)) || misused
}
