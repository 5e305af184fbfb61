#!/usr/bin/env bash
# Gets the files of the sample from repositories on this disk, with simulated contents, and reconstructs them.
# usage: real_sample_test.sh SCRIPT LOG
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "real_sample_test: $*" >&2; exit 1; }
command -v git >/dev/null || { echo "real_sample_test: no git; skipped"; exit 77; }

# repository NAME [FILE PATH]...: with something else in it that is not wanted
export GIT_CONFIG_NOSYSTEM=1 GIT_CONFIG_GLOBAL=$work/config HOME=$work
git config --global uploadpack.allowFilter true
git config --global user.email test@example.org
git config --global user.name test
repository() {
  git init --quiet "$work/$1"
  for ((i = 2; i < $#; i += 2)); do
    local path=$((i + 1))
    install -D "${!i}" "$work/$1/${!path}"
  done
  head -c 1000000 /dev/urandom >"$work/$1/other.avi"
  git -C "$work/$1" add -A
  git -C "$work/$1" commit --quiet -m files
}
video=$2/scan/gelsight.avi touches=docs/franka-servo/datasets/base_data/base_data_for_training/screw_driver_blue_gray
repository videos "$video" "$touches/exp_num_6/camera_0.avi" "$video" "$touches/exp_num_7/camera_0.avi"
repository model "$2/scan/model.json" models/nnmini.pt
export SAMPLE_VIDEOS_URL=file://$work/videos SAMPLE_MODEL_URL=file://$work/model SAMPLE_BARE_FRAMES="0 10"

# Other contents than the published ones.
if "$1" --no-window "$work/sample" >"$work/told" 2>&1; then fail "takes what was not published"; fi
grep -q 'not what was published' "$work/told" || fail "$(cat "$work/told")"
[[ ! -e $work/sample/run ]] || fail "reconstructs what was not published"

sum() { sha256sum "$1" | cut -d' ' -f1; }
SAMPLE_SUMS="$(sum "$video")  touch.avi
$(sum "$video")  bare.avi
$(sum "$2/scan/model.json")  nnmini.pt"
export SAMPLE_SUMS
"$1" --no-window "$work/sample" >"$work/told" 2>&1 || fail "$(cat "$work/told")"
[[ -s $work/sample/run/mesh.ply && -s $work/sample/picture.png ]] || fail "no result: $(cat "$work/told")"
[[ ! -e $work/sample/clone ]] || fail "the clone stays"
# A second time without the network.
SAMPLE_VIDEOS_URL=file:///nowhere "$1" --no-window "$work/sample" >"$work/told" 2>&1 || fail "$(cat "$work/told")"
if SAMPLE_VIDEOS_URL=file:///nowhere "$1" --no-window "$work/other" >"$work/told" 2>&1; then fail "no error without a repository"; fi
grep -q 'cannot clone file:///nowhere' "$work/told" || fail "$(cat "$work/told")"
