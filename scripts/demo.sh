#!/usr/bin/env bash
# usage: scripts/demo.sh [--no-install] [DIR]
#
# Installs what is missing, builds into DIR (as scripts/build.sh; default: build in the repository), simulates
# a pebble of 10 mm rolled over a touch sensor, reconstructs it from the sensor's video alone, and says how far
# trajectory and mesh are from the truth. Safe to run again: it replaces what an earlier run left.
# --no-install does not install packages and stops if some are missing.
#
# Leaves in demo/ in the repository:
#   picture.png      the reconstruction beside the true shape
#   mesh.ply         the reconstructed surface, meters
#   trajectory.tum   the sensor's pose against the pebble, frame by frame, meters
#   log/             the simulated log with its ground truth and model, as a public data folder
#   run/             all that gelslam reconstruct wrote
. "$(dirname "$0")/common.sh"

no_install=
parse --no-install 0 1 "$@"
build=$(realpath -m "${arguments[0]:-$root/build}")
demo=$root/demo gelslam=$build/bin/gelslam

"$root/scripts/build.sh" ${no_install:+--no-install} "$build"

mkdir -p "$demo"
rm -f "$demo"/{mesh.ply,trajectory.tum,picture.png}

say "simulating a sensor and a pebble rolled over it (16 s of video)"
"$gelslam" simulate scan --object pebble --size 0.5 --indentation 0.8 --motion allover \
  --frames 400 -o "$demo/log" --overwrite

say "reconstructing it from the video"
"$gelslam" reconstruct "$demo/log" -o "$demo/run" --overwrite

say "comparing with the truth"
"$gelslam" evaluate "$demo/run" --truth "$demo/log"
"$gelslam" view "$demo/run" --truth "$demo/log" --snapshot "$demo/picture.png" -q
cp "$demo/run/mesh.ply" "$demo/run/trajectory.tum" "$demo/"
say "look at $demo/picture.png; the surface is $demo/mesh.ply, the trajectory $demo/trajectory.tum"
