#!/usr/bin/env bash
# usage: scripts/public_system.sh PUBLIC OUT LOG [MODEL]
#
# Reconstructs LOG, a data folder, with the public Python system into OUT/LOG's name; MODEL (an absolute path) instead of the
# one that its config.yaml names. PUBLIC is a folder with run_reference.py, which drives unchanged checkouts of
# rpl-cmu/normalflow, joehjhuang/gs_sdk and rpl-cmu/gelslam (normalflow/, gs_sdk/ and gelslam/ in it, or where NORMALFLOW,
# GS_SDK and GELSLAM say).
. "$(dirname "$0")/common.sh"

parse "" 3 4 "$@"
public=$1 out=$2 log=$3 folder=$2/logs/$(basename "$3")
model=${4:-$(sed -nE 's/.*calibration_model_path: *"?([^"]+)"?.*/\1/p' "$log/config.yaml")}
mkdir -p "$folder"
ln -sf "$(realpath "$log")"/* "$folder"
rm "$folder/config.yaml"
# It takes no relative path of a model.
sed -E "s|(calibration_model_path:).*|\1 \"$(cd "$log" && realpath -m "$model")\"|" "$log/config.yaml" >"$folder/config.yaml"
exec /usr/bin/python3 "$public/run_reference.py" --normalflow "${NORMALFLOW:-$public/normalflow}" --gs-sdk "${GS_SDK:-$public/gs_sdk}" \
  --gelslam "${GELSLAM:-$public/gelslam}" --out "$out" "$folder"
