#!/usr/bin/env bash
# Fetches what tests/v4l2/run.sh needs: QEMU, busybox and cpio by apt-get, and into a cache folder Debian's kernel with
# its drivers and v4l2loopback, which is built here. Usage: tests/v4l2/setup.sh
# The cache: GELSLAM_V4L2_CACHE, default ~/.cache/gelslam-v4l2 (about 15 MB; 110 MB are downloaded for it).
set -euo pipefail

cache=${GELSLAM_V4L2_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/gelslam-v4l2}
say() { echo "v4l2 setup: $*"; }

as_root=()
((EUID == 0)) || as_root=(sudo)
missing=()
for package in qemu-system-x86 busybox-static cpio make gcc xz-utils; do
  [[ $(dpkg-query --show --showformat '${db:Status-Status}' "$package" 2>/dev/null || true) == installed ]] ||
    missing+=("$package")
done
if ((${#missing[@]} > 0)); then
  say "installing by ${as_root[*]:+${as_root[*]} }apt-get: ${missing[*]}"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends "${missing[@]}"
fi

# The metapackage names the kernel of today.
image=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: \(linux-image-[0-9].*\)/\1/p' | head -1)
if [[ -z $image ]]; then
  say "no linux-image-amd64 in the package lists; run apt-get update (this test needs Debian's kernel for x86-64)" >&2
  exit 1
fi
version=${image#linux-image-}
if [[ -f $cache/version && $(<"$cache/version") == "$version" ]]; then
  say "kernel $version is in $cache"
  exit 0
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
say "downloading kernel $version"
kbuild=$(apt-cache depends "linux-headers-$version" | sed -n 's/.*Depends: \(linux-kbuild-.*\)/\1/p' | head -1)
apt-get download -qq "$image" "linux-headers-$version" "linux-headers-${version%-amd64}-common" "$kbuild" \
  v4l2loopback-dkms 2> >(grep -v 'unsandboxed as root' >&2 || true)
for package in ./*.deb; do dpkg-deb -x "$package" unpacked; done

say "building v4l2loopback"
headers=$work/unpacked/usr/src/linux-headers-$version
sed -i "s|/usr/src/|$work/unpacked/usr/src/|g" "$headers/Makefile" "$headers/.kernelvariables"
if ! make -C "$headers" M="$(echo "$work"/unpacked/usr/src/v4l2loopback-*)" modules >build.log 2>&1; then
  tail -20 build.log >&2
  say "v4l2loopback does not build against kernel $version" >&2
  exit 1
fi

# Every module that is needed, in the order in which the kernel takes them.
mkdir modules
find "$work/unpacked" -name '*.ko' -o -name '*.ko.xz' >all_modules
add_module() {  # name list
  local file name=${1//-/_} needed
  file=$(sed -n "\|/$(sed 's/_/[-_]/g' <<<"$name")\.ko\(\.xz\)\?\$|p" all_modules | head -1)
  [[ -n $file ]] || return 0 # built into the kernel
  ! grep -qx "$name" "$2" || return 0
  case $file in
    *.xz) xz -dc "$file" >"modules/$name.ko" ;;
    *) cp "$file" "modules/$name.ko" ;;
  esac
  for needed in $(tr '\0' '\n' <"modules/$name.ko" | sed -n 's/^depends=//p' | tr ',' ' '); do
    add_module "$needed" "$2"
  done
  echo "$name" >>"$2"
}
: >modules/boot.list
for name in virtio_pci 9pnet_virtio 9p; do add_module "$name" modules/boot.list; done
cp modules/boot.list modules/media.list
for name in v4l2loopback vivid; do add_module "$name" modules/media.list; done
grep -vxFf modules/boot.list modules/media.list | grep -vx -e v4l2loopback -e vivid >modules/media.tmp
mv modules/media.tmp modules/media.list

rm -rf "$cache.new"
mkdir -p "$cache.new"
cp "unpacked/boot/vmlinuz-$version" "$cache.new/vmlinuz"
cp -r modules "$cache.new/"
echo "$version" >"$cache.new/version"
rm -rf "$cache"
mv "$cache.new" "$cache"
say "done: $cache"
