#!/usr/bin/env bash
# usage: scripts/build_wheel.sh [--build DIR] [--check] [OUT]
#
# Makes in OUT (default: packages in the repository), for Linux on x86-64 with this system's glibc or a newer one:
#   gelslam-*.whl      the module, for the system's Python, and the program: pip install OUT/gelslam-*.whl
#   gelslam-*.tar.gz   the program alone: unpack it anywhere, and run bin/gelslam
# Both hold all libraries but glibc, libstdc++, and those of the graphics driver, with their licenses. Ceres and FFmpeg are
# compiled from the system's source packages without their GPL parts, and Open3D is left out.
#
#   --build DIR   take what was built in DIR, with the system's Ceres and FFmpeg (GPL), instead of building first in
#                 build/wheel; the archive is compressed less
#   --check       also use both in a fresh Debian root without a compiler, with a window (needs mmdebstrap and a package
#                 mirror)
. "$(dirname "$0")/common.sh"

build='' check=false compress=gzip
parse "--build= --check" 0 1 "$@"
[[ -z $build ]] || build=$(realpath -e "$build") compress='gzip -1'
out=$(realpath -m "${arguments[0]:-$root/packages}")

python3=/usr/bin/python3
which=$(command -v python3 || true)
[[ $(realpath "${which:-$python3}") == "$(realpath $python3)" ]] ||
  say "the wheel is for $($python3 --version) ($python3), not for $which"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# source_of PACKAGE: unpacks the source of an installed package in the current folder, and prints where.
source_of() {
  local sources=$work/sources options
  mkdir -p "$sources/lists/partial" "$sources/parts"
  for file in /etc/apt/sources.list.d/{debian,ubuntu}.sources; do
    [[ ! -f $file ]] || sed 's/^Types:.*/Types: deb-src/' "$file" >"$sources/parts/${file##*/}"
  done
  [[ ! -f /etc/apt/sources.list ]] || sed 's/^deb /deb-src /' /etc/apt/sources.list >"$sources/parts/main.list"
  options=(-qq -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$sources/parts" -o Dir::State::lists="$sources/lists" -o APT::Sandbox::User=root)
  apt-get "${options[@]}" update >&2
  apt-get "${options[@]}" source "$(dpkg-query -W -f '${source:Package}=${source:Version}' "$1")" >&2
  find "$PWD" -mindepth 1 -maxdepth 1 -type d
}

# Shows the lines that come in the place of each other, on a terminal.
progress() {
  local line
  while read -r line; do [[ ! -t 1 ]] || printf '\r\033[K%.70s' "$1: $line"; done
  [[ ! -t 1 ]] || printf '\r\033[K'
}

# Without what is GPL, and what no log of a sensor needs.
build_ceres() {
  local source
  source=$(source_of libceres-dev)
  cmake -S "$source" -B "$work/ceres" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$parts" -DBUILD_SHARED_LIBS=OFF \
    -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DSUITESPARSE=OFF -DCXSPARSE=OFF -DLAPACK=OFF -DEIGENMETIS=OFF -DMINIGLOG=ON \
    -DMINIGLOG_MAX_LOG_LEVEL=-1 -DGFLAGS=OFF -DCUDA=OFF -DUSE_CUDA=OFF -DSCHUR_SPECIALIZATIONS=OFF -DBUILD_TESTING=OFF -DBUILD_EXAMPLES=OFF \
    -DBUILD_BENCHMARKS=OFF -DPROVIDE_UNINSTALL_TARGET=OFF -DEXPORT_BUILD_DIR=OFF >/dev/null
  cmake --build "$work/ceres" --parallel "$(nproc)" | progress ceres
  cmake --install "$work/ceres" >/dev/null
  install -Dm644 "$source/debian/copyright" "$parts/licenses/ceres-solver"
}
build_ffmpeg() {
  local source
  source=$(source_of libavcodec-dev)
  local decoders=mjpeg,mjpegb,png,rawvideo,h264,hevc,vp8,vp9,mpeg1video,mpeg2video,mpeg4,msmpeg4v1,msmpeg4v2,msmpeg4v3,h263,ffv1,huffyuv
  decoders+=,ffvhuff,utvideo,theora,prores,dnxhd,dvvideo,gif,wmv1,wmv2,wmv3,vc1,flv,bmp,cinepak
  local demuxers=avi,matroska,mov,mpegts,mpegps,mpegvideo,asf,flv,ogg,nut,mxf,ivf,gif,mjpeg,h264,hevc,yuv4mpegpipe
  (cd "$source" && ./configure --prefix="$parts" --disable-autodetect --disable-programs --disable-doc --disable-debug --disable-network \
    --disable-everything --disable-avdevice --disable-avfilter --disable-swresample --disable-postproc --enable-zlib --enable-shared \
    --disable-static --enable-protocol=file --enable-muxer=avi --enable-decoder="$decoders" --enable-demuxer="$demuxers" \
    --enable-parser=mjpeg,png,h264,hevc,vp8,vp9,mpegvideo,mpeg4video,h263,vc1,gif &&
    make -j "$(nproc)" && make install) 2>&1 | tee "$work/ffmpeg.log" | progress ffmpeg || { tail "$work/ffmpeg.log" >&2; exit 1; }
  install -Dm644 "$source/debian/copyright" "$parts/licenses/ffmpeg"
}

parts=$root/build/wheel-parts
if [[ -z $build ]]; then
  build=$root/build/wheel
  "$root/scripts/setup.sh" --wheel
  for part in ceres ffmpeg; do
    [[ -f $parts/licenses/$part || -f $parts/licenses/$part-solver ]] && continue
    say "compiling $part, which is kept in $parts"
    mkdir "$work/$part-source"
    (cd "$work/$part-source" && "build_$part")
  done
  PKG_CONFIG_PATH=$parts/lib/pkgconfig cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$parts" \
    -DGELSLAM_BUILD_PYTHON=ON -DPython_EXECUTABLE=$python3 -DCMAKE_DISABLE_FIND_PACKAGE_Open3D=ON >/dev/null
  cmake --build "$build" --parallel "$(nproc)" --target gelslam_app gelslam_python
fi
cached() { sed -n "s/^$1:[A-Z]*=//p" "$build/CMakeCache.txt"; }
[[ $(cached GELSLAM_BUILD_PYTHON) == ON ]] || fail "$build has no Python module (GELSLAM_BUILD_PYTHON)"
version=$(cached CMAKE_PROJECT_VERSION) python=$(cached _Python_EXECUTABLE)

# The program's folder: bin, lib, share, licenses. The module lies beside them.
DESTDIR=$work/installed cmake --install "$build" --prefix /usr --component runtime >/dev/null
DESTDIR=$work/installed cmake --install "$build" --prefix /usr --component python >/dev/null
package=$work/wheel/gelslam
mkdir -p "$work/wheel"
mv "$work/installed/usr/$(cached GELSLAM_PYTHON_DIR)/gelslam" "$package"
mkdir -p "$package"/{bin,lib,share,licenses}
mv "$work/installed/usr/bin/gelslam" "$package/bin/"
cp /usr/share/fonts/truetype/dejavu/DejaVuSans{,-Bold}.ttf "$package/share/"
cp "$root/LICENSE" "$package/licenses/gelslam"
module=$(echo "$package"/_core.*.so)
strip --strip-unneeded "$package/bin/gelslam" "$module"

# license_of PACKAGE
license_of() { cp "/usr/share/doc/$1/copyright" "$package/licenses/$1"; }
for part in fonts-dejavu-core libimgui-dev libmeshoptimizer-dev libeigen3-dev pybind11-dev libcli11-dev nlohmann-json3-dev; do license_of "$part"; done

# Every library that is not the system's. No other library of the process has its name. X's keep theirs: the graphics
# driver asks for them, too.
declare -A file_of owner_of version_of
while read -r name _ path _; do
  [[ $path == /* ]] || continue
  case $name in
    libc.so* | libm.so* | libdl.so* | libpthread.so* | librt.so* | libresolv.so* | libstdc++.so* | libgcc_s.so* | ld-linux*) continue ;;
    libGL.so* | libGLX.so* | libEGL.so* | libOpenGL.so* | libGLdispatch.so*) continue ;;
  esac
  file_of[$name]=$(realpath "$path")
done < <({ LD_LIBRARY_PATH=$parts/lib ldd "$package/bin/gelslam" "$module"; } | sort -u -k1,1)
# All at once: each search reads the lists of all packages. Some packages say /lib for what lies in /usr/lib.
while read -r line; do
  file=${line##*: } owner_of[/usr${file#/usr}]=${line%%: *}
done < <(dpkg -S "${file_of[@]}" "${file_of[@]#/usr}" 2>/dev/null)
while read -r owner version_of_owner; do
  version_of[$owner]=$version_of_owner
done < <(dpkg-query -W -f '${binary:Package} ${Version}\n' "${owner_of[@]}")
renamed=()
for name in $(printf '%s\n' "${!file_of[@]}" | sort); do
  path=${file_of[$name]}
  if [[ $path == "$parts"/* ]]; then
    origin="ffmpeg $(dpkg-query -W -f '${source:Version}' libavcodec-dev), compiled anew"
    cp "$parts/licenses/"* "$package/licenses/"
  else
    owner=${owner_of[$path]}
    origin="$owner ${version_of[$owner]}"
    license_of "${owner%%:*}"
  fi
  case $name in
    libX* | libxcb* | libbsd* | libmd.*) target=$name ;;
    *) target=gelslam-$name renamed+=(--replace-needed "$name" "$target") ;;
  esac
  install -m644 "$path" "$package/lib/$target"
  printf '%-40s %s\n' "$target" "$origin"
done >"$work/libraries"
{ echo "Libraries, and the packages of $(. /etc/os-release && echo "$PRETTY_NAME") that they and their sources are from:"
  cat "$work/libraries"; } >"$package/licenses/LIBRARIES"
grep -ohE '/usr/share/common-licenses/[A-Z][A-Za-z0-9.-]*[A-Za-z0-9]' "$package"/licenses/* | sort -u | while read -r text; do
  [[ ! -f $text ]] || cp "$text" "$package/licenses/common-${text##*/}"
done
# OpenCV asks GLX which context is current; nothing here does that, and the module needs no X.
for core in "$package"/lib/gelslam-libopencv_core.*; do
  LC_ALL=C sed -i 's/glX\(GetCurrentContext\|GetCurrentDisplay\|GetProcAddressARB\)/gsl\1/g' "$core"
  echo 'void *gslGetCurrentContext(void) { return 0; } void *gslGetCurrentDisplay(void) { return 0; }
        void *gslGetProcAddressARB(const char *name) { return 0; }' |
    cc -shared -fPIC -s -Wl,-soname,gelslam-noglx.so -o "$package/lib/gelslam-noglx.so" -x c -
  patchelf --replace-needed libGLX.so.0 gelslam-noglx.so "$core"
done
# One change at a time: patchelf mixes them up otherwise.
for binary in "$package"/lib/* "$package/bin/gelslam" "$module"; do
  case $binary in
    */lib/*)
      patchelf --set-soname "${binary##*/}" "$binary"
      place= ;;
    */bin/*) place=/../lib ;;
    *) place=/lib ;;
  esac
  patchelf "${renamed[@]}" "$binary"
  patchelf --set-rpath "\$ORIGIN$place" "$binary"
done
chmod 644 "$module"

mkdir -p "$out"
tag=$(uname -m)
archive=gelslam-$version-linux-$tag
mkdir "$work/$archive"
cp -r "$package"/{bin,lib,share,licenses} "$root"/{LICENSE,README.md,configs} "$work/$archive/"
tar -C "$work" --owner=0 --group=0 --sort=name --use-compress-program "$compress" -cf "$out/$archive.tar.gz" "$archive"
say "$out/$archive.tar.gz"

info=$work/wheel/gelslam-$version.dist-info
minor=$("$python" -c 'import sys; print(f"{sys.version_info.major}{sys.version_info.minor}")')
mkdir "$info"
mv "$package/licenses" "$info/"
printf 'Wheel-Version: 1.0\nGenerator: gelslam\nRoot-Is-Purelib: false\nTag: cp%s-cp%s-manylinux_%s_%s\n' "$minor" "$minor" \
  "$(ldd --version | sed -n '1s/.* \([0-9]*\)\.\([0-9]*\)$/\1_\2/p')" "$tag" >"$info/WHEEL"
printf 'Metadata-Version: 2.1\nName: gelslam\nVersion: %s\nSummary: Tactile SLAM for camera-based touch sensors\nLicense: MIT\nRequires-Dist: numpy\n' \
  "$version" >"$info/METADATA"
printf '[console_scripts]\ngelslam = gelslam.__main__:main\n' >"$info/entry_points.txt"
/usr/bin/python3 -m wheel pack --dest-dir "$out" "$work/wheel" >/dev/null
wheel=$(echo "$out/gelslam-$version-cp$minor"-*.whl)
say "$wheel"
say "for $("$python" --version): $python -m venv --system-site-packages gel && gel/bin/pip install $wheel && . gel/bin/activate"

$check || exit 0
say "using them in a fresh root"
mmdebstrap --variant=apt --include=ca-certificates,python3-numpy,python3-pip,xvfb,xauth,libgl1-mesa-dri,libgl1,libegl1 \
  --customize-hook='mkdir -p $1/packages' --customize-hook="copy-in $out/$archive.tar.gz $wheel /packages" \
  --chrooted-customize-hook='set -eux; cd /tmp; ! command -v cc
    tar -xf /packages/*.tar.gz; mv gelslam-* "moved here"; "moved here/bin/gelslam" simulate scan --object coin --frames 60 -o log -q
    "moved here/bin/gelslam" reconstruct log -o run -q; rm -r "moved here"
    python3 -m pip install --no-index --break-system-packages /packages/*.whl
    gelslam --version; python3 -m gelslam info run
    python3 -c "import gelslam; run = gelslam.reconstruct(\"log\"); print(run, run.evaluate(\"log\")[\"trajectory\"])"
    gelslam view run --snapshot run.png -q; test -s run.png
    code=0; xvfb-run -a timeout -s INT 10 gelslam view run || code=$?; test $code = 124' \
  "$(. /etc/os-release && echo "$VERSION_CODENAME")" /dev/null
say "used in a fresh root"
