# Sourced by the test scripts that run inside the virtual machine. `build`, `cache`, `here`, `work` are folders.
set -uo pipefail

gelslam=$build/bin/gelslam
tmp=$(mktemp -d /dev/shm/test.XXXX)
export PYTHONPATH=$here/guest PYTHONDONTWRITEBYTECODE=1  # readable.py

fail() {
  echo "  failed: $*"
  exit 1
}
# has TEXT FILE: the file holds the text
has() { grep -qF -- "$1" "$2" || { head -40 "$2" | cut -c-200 | sed "s|^|    \| |"; fail "no \"$1\""; }; }
lacks() { ! grep -qF -- "$1" "$2" || { head -40 "$2" | cut -c-200 | sed "s|^|    \| |"; fail "has \"$1\""; }; }
# fails_with CODE COMMAND...: it ends with this exit code; its output is in $tmp/out and $tmp/err
runs_with() {
  local expected=$1 code=0
  shift
  "$@" >"$tmp/out" 2>"$tmp/err" || code=$?
  [[ $code == "$expected" ]] || { head -20 "$tmp/out" "$tmp/err"; fail "exit code $code instead of $expected: $*"; }
}

# A camera like a GelSight Mini, /dev/video10, with its name; it gives pictures while feed runs.
load_loopback() {
  busybox insmod "$cache/modules/v4l2loopback.ko" video_nr=10 exclusive_caps=1 card_label='"GelSight Mini R0B TEST"'
}
# feed FOLDER RATE FRAMES [LOG]: in the background, once the camera has its format; $feeder is its process id. With LOG
# each picture is shown until this file has grown.
feed() {
  "$build/bin/virtual_camera" feed "$2" "${4:-}" /dev/video10 "$1" "$3" >"$tmp/feeder" &
  feeder=$!
  until grep -q feeding "$tmp/feeder"; do
    kill -0 $feeder 2>/dev/null || fail "the virtual camera cannot be fed"
    sleep 0.05
  done
}
stop_feeding() {
  [[ -n ${feeder:-} ]] || return
  kill "$feeder" 2>/dev/null
  wait "$feeder" 2>/dev/null
  feeder=
}
load_vivid() {
  busybox insmod "$cache/modules/vivid.ko" n_devs=1 node_types=0x20001 num_inputs=1 input_types=0x0 \
    vid_cap_nr=20 meta_cap_nr=21
}

# The next script finds the machine as this one did.
clean_up() {
  stop_feeding
  for module in vivid v4l2loopback; do busybox rmmod $module 2>/dev/null; done
}
trap clean_up EXIT
