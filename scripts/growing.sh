#!/usr/bin/env bash
# usage: scripts/growing.sh [SAMPLE [OUT]]
#
# Makes the README's first picture: the live window while the touch that scripts/real_sample.sh left in SAMPLE (default:
# sample in the repository) is replayed at its own pace, 18 s. OUT: default docs/images/growing.webp. Needs build/bin/gelslam,
# Xvfb and ffmpeg, and a machine that has two cores to spare for the 18 s: it says how many pictures differ (of 80).
. "$(dirname "$0")/common.sh"

parse "" 0 2 "$@"
sample=$(realpath "${arguments[0]:-$root/sample}") out=$(realpath -m "${arguments[1]:-$root/docs/images/growing.webp}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The gel at rest: the frames that real_sample.sh takes, too.
ffmpeg -v error -i "$sample/bare.avi" -vf "select='between(n,400,440)',tmix=frames=32" -fps_mode passthrough -update 1 "$work/bare.png"
export GELSLAM=$root/build/bin/gelslam sample work
xvfb-run -a -s "-screen 0 1280x800x24" bash -c '
  cd "$work"
  ffmpeg -v error -f x11grab -draw_mouse 0 -framerate 10 -video_size 1280x800 -i "$DISPLAY" -c:v mjpeg -q:v 2 window.mkv &
  "$GELSLAM" scan "$sample/touch.avi" --background bare.png --model "$sample/nnmini.pt" -o handle -q &
  until [[ -f handle/mesh.ply ]]; do sleep 0.2; done
  sleep 2
  kill -INT %1
  kill %2
  wait || true'
# Ten seconds of it.
seconds=$(ffprobe -v error -show_entries format=duration -of csv=p=0 "$work/window.mkv")
ffmpeg -v error -y -ss 1.5 -i "$work/window.mkv" -vf "setpts=PTS*10/($seconds-1.5),fps=8,scale=800:-2:flags=area" -c:v libwebp_anim -quality 55 \
  -compression_level 6 -loop 0 "$out"
ffmpeg -v error -i "$work/window.mkv" -ss 1.5 -vf "fps=80/($seconds-1.5),mpdecimate" -f framemd5 - | grep -vc '^#' |
  sed 's/.*/& pictures of 80 differ/'
