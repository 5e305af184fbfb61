# `gelslam record`: the camera's own bytes, untouched; a camera that is unplugged leaves a whole log.
. "$here/guest/common.sh"

load_loopback
# Slowly: the loopback driver writes on into a buffer that a reader who lags has taken, and the machine is an emulated one.
feed "$work/made_up" 10 100000
runs_with 0 "$gelslam" record --keep-free 1MB --camera "GelSight Mini" --seconds 8 -o "$tmp/log.mkv"
head -3 "$tmp/err"
runs_with 0 "$gelslam" info --json "$tmp/log.mkv"
python3 "$here/guest/sent_frames.py" "$tmp/log.mkv" "$tmp/out" "$work/made_up" || fail "the log is not as expected"
grep -aq "keep_format 0" "$tmp/log.mkv" || fail "the camera's settings are not in the log"
stop_feeding

# vivid, unplugged in the middle
load_vivid
cat >"$tmp/vivid.yaml" <<'Y'
device_config:
  camera: "/dev/video20"
  camera_format: "YUYV"
  raw_imgw: 640
  raw_imgh: 480
  framerate: 5
Y
"$gelslam" record --keep-free 1MB --config "$tmp/vivid.yaml" -o "$tmp/unplugged.mkv" >"$tmp/out" 2>"$tmp/err" &
recorder=$!
for _ in {1..100}; do
  [[ $(stat -c %s "$tmp/unplugged.mkv" 2>/dev/null || echo 0) -gt 2000000 ]] && break
  sleep 0.3
done
"$build/bin/virtual_camera" control /dev/video20 Disconnect 1
wait $recorder
[[ $? == 2 ]] || { cat "$tmp/err"; fail "it did not notice"; }
grep "gelslam: error" "$tmp/err"
has "error: /dev/video20: the camera is gone; is it unplugged?" "$tmp/err"
runs_with 0 "$gelslam" info "$tmp/unplugged.mkv"
grep "readable" "$tmp/out" || fail "the log cannot be read"
