# `gelslam devices` against drivers of a real kernel: a loopback camera without and with a feeder, vivid with its metadata node.
. "$here/guest/common.sh"

load_loopback
runs_with 1 "$gelslam" devices
has "no camera (an output or a decoder)" "$tmp/out"

feed "$work/made_up" 25 100000
load_vivid
runs_with 0 "$gelslam" devices
cut -c-160 "$tmp/out"
has "/dev/video10  GelSight Mini R0B TEST" "$tmp/out"
has "looks like a GelSight Mini" "$tmp/out"
has "MJPG 3280x2464" "$tmp/out"
has "in use by virtual_camera (pid $feeder)" "$tmp/out"
has "/dev/video20  vivid" "$tmp/out"
has "only metadata of this camera" "$tmp/out"
has "YUYV 640x480 at 25" "$tmp/out"

runs_with 0 "$gelslam" devices --json
python3 - "$tmp/out" <<'P' || fail "the JSON is not as expected"
import json, sys
cameras = {camera["path"]: camera for camera in json.load(open(sys.argv[1]))["cameras"]}
assert list(cameras) == ["/dev/video10", "/dev/video20", "/dev/video21"], list(cameras)
mini, vivid, metadata = cameras.values()
assert mini["kind"] == "camera" and mini["sensor"] == "GelSight Mini" and mini["problem"] == ""
assert {"format": "MJPG", "width": 3280, "height": 2464}.items() <= mini["modes"][0].items(), mini["modes"]
assert vivid["kind"] == "camera" and vivid["sensor"] == "" and len(vivid["modes"]) > 10
assert any(c["name"] == "gain_automatic" and c["automatic"] for c in vivid["controls"]), vivid["controls"]
assert metadata["kind"] == "metadata" and metadata["modes"] == []
P

