#!/usr/bin/env bash
# usage: scripts/public_system.sh PUBLIC OUT LOG [MODEL]
#
# Reconstructs LOG, a data folder, with the public Python system into OUT/LOG's name; MODEL (an absolute path) instead of the
# one that its config.yaml names. PUBLIC is a folder with unchanged checkouts of github.com/rpl-cmu/normalflow (8c17b67),
# joehjhuang/gs_sdk (2359f03) and rpl-cmu/gelslam (e0ea7de) in normalflow/, gs_sdk/ and gelslam/, or where NORMALFLOW, GS_SDK
# and GELSLAM say. scripts/public_system/run_reference.py drives them with the network in NumPy; standins.py stands in for what
# is missing of ROS, GTSAM and Open3D. Needs python3-skimage, python3-scipy, python3-opencv, python3-yaml and ffmpeg. With ATLAS
# instead of OpenBLAS (libopenblas0-pthread) the network takes six times as long.
. "$(dirname "$0")/common.sh"

parse "" 3 4 "$@"
public=$1 out=$2 log=$3 folder=$2/logs/$(basename "$3")
model=${4:-$(sed -nE 's/.*calibration_model_path: *"?([^"]+)"?.*/\1/p' "$log/config.yaml")}
mkdir -p "$folder"
ln -sf "$(realpath "$log")"/* "$folder"
rm "$folder/config.yaml"
# It takes no relative path of a model.
sed -E "s|(calibration_model_path:).*|\1 \"$(cd "$log" && realpath -m "$model")\"|" "$log/config.yaml" >"$folder/config.yaml"
exec /usr/bin/python3 "$root/scripts/public_system/run_reference.py" --mlp numpy --normalflow "${NORMALFLOW:-$public/normalflow}" \
  --gs-sdk "${GS_SDK:-$public/gs_sdk}" --gelslam "${GELSLAM:-$public/gelslam}" --out "$out" "$folder"
