# `gelslam record`: the camera's own bytes, untouched; one log of a camera that is unplugged and comes back.
. "$here/guest/common.sh"

load_loopback
# Slowly: the loopback driver writes on into a buffer that a reader who lags has taken, and the machine is an emulated one.
feed "$work/made_up" 10 100000
runs_with 0 "$gelslam" record --keep-free 1MB --camera "GelSight Mini" --seconds 8 -o "$tmp/log.mkv"
head -3 "$tmp/err"
"$gelslam" info --json "$tmp/log.mkv" >"$tmp/out" 2>"$tmp/err"  # its exit code tells whether the machine stood still
python3 "$here/guest/sent_frames.py" "$tmp/log.mkv" "$tmp/out" "$work/made_up" || fail "the log is not as expected"
grep -aq "keep_format 0" "$tmp/log.mkv" || fail "the camera's settings are not in the log"
stop_feeding

# vivid, unplugged in the middle; it is there again at once
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
# has_grown_to BYTES: the log has
has_grown_to() {
  for _ in {1..300}; do
    [[ $(stat -c %s "$tmp/unplugged.mkv" 2>/dev/null || echo 0) -gt $1 ]] && return
    sleep 0.2
  done
  cat "$tmp/err"
  fail "the log does not grow to $1 bytes"
}
has_grown_to 2000000
"$build/bin/virtual_camera" control /dev/video20 Disconnect 1
sleep 2
has_grown_to $(($(stat -c %s "$tmp/unplugged.mkv") + 2000000))
kill -INT $recorder
wait $recorder || { cat "$tmp/err"; fail "exit code $?"; }
has "warning: the camera was away for" "$tmp/err"
tail -1 "$tmp/err"
"$gelslam" info "$tmp/unplugged.mkv" >"$tmp/out" 2>&1
grep "readable" "$tmp/out" || fail "the log cannot be read"
