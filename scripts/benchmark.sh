#!/usr/bin/env bash
# usage: scripts/benchmark.sh [--against COMMIT | --program BEFORE] [FILTER]
#
# Runs the micro-benchmarks of this commit and of an earlier one in turn, so that both see the same machine. Writes
# build/benchmarks/COMMIT.json (nanoseconds, ratios) and prints the ratios now / before.
#   --against COMMIT   default: the last commit with such a file, else the one before this
#   --program BEFORE   a gelslam-lab that is built already, instead of a commit
#   FILTER             regular expression, such as registration/
. "$(dirname "$0")/common.sh"

against='' program=''
parse "--against= --program=" 0 1 "$@"
folder=$root/build/benchmarks
declare -A lab=([now]=$root/build/bin/gelslam-lab [before]=$program)
commit=$(git -C "$root" rev-parse --short HEAD)
mkdir -p "$folder"

if [[ -z $program ]]; then
  if [[ -z $against ]]; then
    last=$(find "$folder" -maxdepth 1 -name '*.json' ! -name "$commit.json" -printf '%T@ %f\n' | sort -n | tail -1)
    against=$(basename "${last##* }" .json)
  fi
  against=$(git -C "$root" rev-parse --short "${against:-HEAD~1}")
  source=$folder/src-$against lab[before]=$folder/$against/bin/gelslam-lab
  [[ -d $source ]] || git -C "$root" worktree add --detach "$source" "$against" >/dev/null
  [[ -x ${lab[before]} ]] || "$source/scripts/build.sh" --lab "$folder/$against"
  "$root/scripts/build.sh" --lab "$root/build"
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for round in {0..4}; do
  for state in now before; do
    "${lab[$state]}" micro-benchmarks "${arguments[@]}" --benchmark_format=json --benchmark_min_time=0.1 >"$work/$state-$round.json" 2>/dev/null
  done
done
/usr/bin/python3 - "$work" "$folder/$commit.json" "$commit" "${against:-$program}" <<'END'
import json, pathlib, sys
import pandas as pd

work, out, commit, against = pathlib.Path(sys.argv[1]), *sys.argv[2:]


def nanoseconds(state):
    runs = pd.concat(pd.DataFrame(json.loads(path.read_text())["benchmarks"]) for path in work.glob(f"{state}-*.json"))
    time = runs["cpu_time"] * runs["time_unit"].map({"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9})
    return time.groupby(runs["name"], sort=False).median()


now = nanoseconds("now")
ratios = (now / nanoseconds("before")).reindex(now.index).dropna().round(3)
context = json.loads((work / "now-0.json").read_text())["context"]
pathlib.Path(out).write_text(json.dumps({"commit": commit, "against": against, "date": context["date"], "processor_mhz": context["mhz_per_cpu"],
                                         "ns": now.to_dict(), "ratio": ratios.to_dict()}, indent=1))
for name, ratio in ratios.items():
    print(f"{ratio:6.2f}  {name}")
print(f"written: {out}")
END
