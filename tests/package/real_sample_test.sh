#!/usr/bin/env bash
# Gets the files of the sample from this disk, with simulated contents, and reconstructs them.
# usage: real_sample_test.sh SCRIPT LOG
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "real_sample_test: $*" >&2; exit 1; }

video=$2/scan/gelsight.avi
for touch in 6 7; do install -D "$video" "$work/videos/exp_num_$touch/camera_0.avi"; done
export SAMPLE_VIDEOS_URL=file://$work/videos SAMPLE_MODEL_URL=file://$2/scan/model.json SAMPLE_BARE_FRAMES="0 10"

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
# A second time without the network.
SAMPLE_VIDEOS_URL=file:///nowhere "$1" --no-window "$work/sample" >"$work/told" 2>&1 || fail "$(cat "$work/told")"
if SAMPLE_VIDEOS_URL=file:///nowhere "$1" --no-window "$work/other" >"$work/told" 2>&1; then fail "no error without a source"; fi
grep -q 'cannot get file:///nowhere' "$work/told" || fail "$(cat "$work/told")"
