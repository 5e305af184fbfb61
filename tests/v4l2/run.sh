#!/usr/bin/env bash
# Runs the program against virtual cameras of a real kernel, in QEMU: tests/v4l2/run.sh BUILD [SCRIPT...]
# BUILD holds bin/gelslam and the programs of this folder. Without scripts: all of tests/v4l2/guest/[0-9]*.sh, in one
# boot. Needs what tests/v4l2/setup.sh fetches, else exit code 77 (skipped).
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
build=$(cd "${1:?usage: run.sh BUILD [SCRIPT...]}" && pwd -P)
shift
scripts=("$@")
((${#scripts[@]} > 0)) || scripts=("$here"/guest/[0-9]*.sh)
for i in "${!scripts[@]}"; do scripts[i]=$(realpath "${scripts[i]}"); done
cache=${GELSLAM_V4L2_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/gelslam-v4l2}
skip() {
  echo "SKIPPED: $*; tests/v4l2/setup.sh fetches it"
  exit 77
}
for tool in qemu-system-x86_64 busybox cpio; do
  command -v "$tool" >/dev/null || skip "$tool is not installed"
done
[[ -f $cache/version ]] || skip "no kernel in $cache"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Pictures are made out here, where it is quick.
mkdir "$work/made_up" "$work/scan"
"$build/bin/raw_frames" "$work/made_up" 3
scan_video=$(realpath -m "${GELSLAM_DATA:-$here/../../../shared/data}")/sequences/track_peanut/gelsight.avi
if [[ ${scripts[*]} == *_scan.sh* && -f $scan_video ]]; then
  "$build/bin/raw_frames" "$work/scan" "${GELSLAM_V4L2_SCAN_FRAMES:-34}" "$scan_video"
fi

# The machine's first program, and what it needs before it can see this system's disk.
mkdir -p "$work/root"/{bin,host,proc,sys}
cp "$(command -v busybox)" "$work/root/bin/busybox"
for module in $(<"$cache/modules/boot.list"); do cp "$cache/modules/$module.ko" "$work/root/"; done
cp "$cache/modules/boot.list" "$work/root/"
cp "$here/guest/init" "$work/root/init"
{
  for name in here build cache work; do printf '%s=%q\n' "$name" "${!name}"; done
  printf 'data=%q\n' "$(dirname "$scan_video")"
  printf 'scripts=%q\n' "${scripts[*]}"
} >"$work/root/settings"
(cd "$work/root" && find . | cpio -o -H newc --quiet) >"$work/initramfs"

# The kernel unpacked: the emulated processor takes 6 s for it.
python3 - "$cache/vmlinuz" <<'P' | xz -dc >"$work/vmlinux"
import struct, sys
image = open(sys.argv[1], "rb").read()
offset, length = struct.unpack_from("<II", image, 0x248)  # of the payload; see Documentation/x86/boot.rst of Linux
begin = 512 * (image[0x1F1] + 1) + offset
sys.stdout.buffer.write(image[begin : begin + length - 4])
P

timeout "${GELSLAM_V4L2_TIMEOUT_S:-850}" qemu-system-x86_64 -accel tcg -cpu max -m 1536 -nodefaults -nographic \
  -serial stdio -no-reboot -kernel "$work/vmlinux" -initrd "$work/initramfs" \
  -append 'console=ttyS0 quiet loglevel=3 panic=-1' \
  -fsdev local,id=host,path=/,security_model=none,readonly=on,multidevs=remap \
  -device virtio-9p-pci,fsdev=host,mount_tag=host </dev/null | sed -u 's/\r//g; s/\x1bc\|\x1b\[[0-9;?]*[a-zA-Z]//g' | tee "$work/log" || true

for script in "${scripts[@]}"; do
  name=$(basename "$script" .sh)
  if ! grep -q "^PASSED $name\$\|^SKIPPED $name" "$work/log"; then
    echo "v4l2: $name failed (see above)"
    failed=true
  fi
done
[[ -z ${failed:-} ]]
