#!/usr/bin/env bash
# usage: scripts/public_system.sh PUBLIC OUT LOG
#
# Reconstructs LOG, a data folder whose config.yaml has the absolute path of a model, with the public Python system into
# OUT/LOG's name. PUBLIC is a folder with run_reference.py, which drives unchanged checkouts of rpl-cmu/normalflow,
# joehjhuang/gs_sdk and rpl-cmu/gelslam (normalflow/, gs_sdk/ and gelslam/ in it, or where NORMALFLOW, GS_SDK and GELSLAM
# say).
(($# == 3)) || { sed -n '2,7s/^# \?//p' "$0" >&2; exit 2; }
exec /usr/bin/python3 "$1/run_reference.py" --normalflow "${NORMALFLOW:-$1/normalflow}" --gs-sdk "${GS_SDK:-$1/gs_sdk}" \
  --gelslam "${GELSLAM:-$1/gelslam}" --out "$2" "$3"
