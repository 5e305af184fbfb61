#!/usr/bin/env bash
# usage: scripts/package.sh [--build DIR] [--check] [OUT]
#
# Makes Debian packages for this system (Debian 12 or 13, Ubuntu 24.04) in OUT (default: packages in the repository):
#   gelslam           the program, its manual page, shell completion, udev rule, desktop entry, documentation,
#                     examples
#   libgelslam-dev    the C++ library: headers, static libraries, CMake package
#   python3-gelslam   the Python module
# Install them with: apt install ./gelslam_*.deb
#
#   --build DIR   take what was built in DIR, instead of building first
#   --check       also run lintian, and install and remove the packages in a fresh Debian root (needs lintian,
#                 mmdebstrap and a package mirror)
. "$(dirname "$0")/common.sh"

build='' check=false
parse "--build= --check" 0 1 "$@"
[[ -z $build ]] || build=$(realpath -e "$build")
out=$(realpath -m "${arguments[0]:-$root/packages}")

if [[ -z $build ]]; then
  build=$root/build
  "$root/scripts/setup.sh" --packages
  "$root/scripts/build.sh" "$build"
  cmake -S "$root" -B "$build" -DGELSLAM_BUILD_PYTHON=ON -DPython_EXECUTABLE=/usr/bin/python3 >/dev/null
  cmake --build "$build" --parallel "$(nproc)" --target all
fi
cached() { sed -n "s/^$1:[A-Z]*=//p" "$build/CMakeCache.txt"; }
# As in 0.3.0+debian13: what they need has other versions on other systems.
version=$(cached CMAKE_PROJECT_VERSION)+$(. /etc/os-release && echo "$ID${VERSION_ID:-}")
architecture=$(dpkg --print-architecture)
maintainer="The GelSLAM authors <gelslam@users.noreply.github.com>"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# stage PACKAGE COMPONENT: what cmake --install puts there, stripped, with the files that every package has.
stage() {
  local tree=$work/$1 doc=$work/$1/usr/share/doc/$1
  DESTDIR=$tree cmake --install "$build" --prefix /usr --component "$2" >/dev/null
  find "$tree" -type f \( -perm -u+x -o -name '*.so' \) -exec strip --strip-unneeded {} +
  find "$tree" -type f -name '*.a' -exec strip --strip-debug {} +
  find "$tree" -type f -name '*.so' -exec chmod 644 {} +
  mkdir -p "$doc"
  { echo "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/"
    printf '\nFiles: *\nCopyright: 2026 The GelSLAM authors\nLicense: Expat\n'
    sed -n '/^Permission/,$p' "$root/LICENSE" | sed 's/^$/./; s/^/ /'; } >"$doc/copyright"
  { echo "gelslam ($version) unstable; urgency=medium"
    printf '\n  * See CHANGELOG.md in the documentation of the package gelslam.\n\n'
    echo " -- $maintainer  $(date -R -d "@$(git -C "$root" log -1 --format=%ct 2>/dev/null || date +%s)")"; } |
    gzip -9n >"$doc/changelog.gz"
}

# The shared libraries that binaries of a staged package need.
shared_libraries() {
  mkdir -p "$work/debian"
  printf 'Source: gelslam\n\nPackage: gelslam\nArchitecture: any\n' >"$work/debian/control"
  (cd "$work" && find "$1" -type f \( -path '*/bin/*' -o -name '*.so' \) -exec dpkg-shlibdeps -O --ignore-missing-info {} + 2>/dev/null) |
    sed -n 's/^shlibs:Depends=//p'
}

# finish PACKAGE SECTION DEPENDS RECOMMENDS: with the description on standard input.
finish() {
  local tree=$work/$1
  mkdir -p "$tree/DEBIAN"
  { printf 'Package: %s\nSource: gelslam\nVersion: %s\nArchitecture: %s\nMaintainer: %s\n' "$1" "$version" "$architecture" "$maintainer"
    printf 'Section: %s\nPriority: optional\nInstalled-Size: %s\n' "$2" "$(du -sk --exclude=DEBIAN "$tree" | cut -f1)"
    [[ -z $3 ]] || echo "Depends: $3"
    [[ -z $4 ]] || echo "Recommends: $4"
    echo "Description: $(cat)"; } >"$tree/DEBIAN/control"
  (cd "$tree" && find . -type f -not -path './DEBIAN/*' -printf '%P\0' | sort -z | xargs -0 md5sum >DEBIAN/md5sums)
  find "$tree" -type d -exec chmod 755 {} +
  dpkg-deb --root-owner-group -Zxz -z1 --build "$tree" "$out" >/dev/null
  say "$out/$1_${version}_$architecture.deb"
}

# The manual page: the help of every command, as it is printed.
manual_page() {
  local program=$1 command sub
  section() { printf '.SH %s\n.nf\n' "${*^^}" && "$program" "$@" --help | sed 's/\\/\\e/g; s/-/\\-/g; s/^\([.'\'']\)/\\\&\1/' && echo .fi; }
  printf '.TH GELSLAM 1 "" "gelslam %s" "User Commands"\n.SH NAME\ngelslam \\- tactile SLAM for camera\\-based touch sensors\n' "$version"
  printf '.SH SYNOPSIS\n.B gelslam\n.I COMMAND\n[\\fIOPTIONS\\fR]\n.SH DESCRIPTION\n'
  printf 'Tracks an object that is rolled across a touch sensor, and reconstructs its surface. Each section is the help of a command.\n'
  commands_of() { "$program" "$@" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z]*\) .*/\1/p'; }
  for command in $(commands_of); do
    [[ $command == benchmark ]] && continue
    section "$command"
    for sub in $(commands_of "$command"); do section "$command" "$sub"; done
  done
}

mkdir -p "$out"
stage gelslam runtime
tree=$work/gelslam
install -Dm644 "$root/packaging/gelslam.bash-completion" "$tree/usr/share/bash-completion/completions/gelslam"
install -Dm644 "$root/packaging/61-gelslam.rules" "$tree/lib/udev/rules.d/61-gelslam.rules"
install -Dm644 "$root/packaging/gelslam.desktop" "$tree/usr/share/applications/gelslam.desktop"
install -Dm644 "$root/packaging/gelslam.svg" "$tree/usr/share/icons/hicolor/scalable/apps/gelslam.svg"
# README, pages and examples, beside each other as in the repository, so that their links hold.
doc=$tree/usr/share/doc/gelslam
(cd "$root" && find README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md CITATION.cff docs examples configs -type f -not -name '*.pyc' \
  -exec install -Dm644 {} "$doc/{}" \;)
mkdir -p "$tree/usr/share/man/man1"
manual_page "$build/bin/gelslam" | gzip -9n >"$tree/usr/share/man/man1/gelslam.1.gz"
finish gelslam science "$(shared_libraries "$tree"), fonts-dejavu-core" "libgl1-mesa-dri" <<'END'
tactile SLAM for camera-based touch sensors
 You roll an object across a GelSight Mini or DIGIT sensor and watch its
 surface grow, or run the same program on a recorded log. The result is a
 mesh and the trajectory of the motion. The program also calibrates sensors,
 streams poses and localizes the sensor in known maps.
END

stage libgelslam-dev development
finish libgelslam-dev libdevel "libeigen3-dev, libopencv-dev, libceres-dev, libfmt-dev, libzip-dev, libyaml-cpp-dev, libsqlitecpp-dev, zlib1g-dev, libturbojpeg0-dev, libpng-dev, libavformat-dev, libavcodec-dev, libavutil-dev, libswscale-dev, libassimp-dev, pkgconf" "" <<'END'
tactile SLAM for camera-based touch sensors (C++ library)
 Surfaces from tactile images, registration by NormalFlow, tracking and
 mapping as C++ libraries, with a CMake package: find_package(gelslam).
END

if [[ $(cached GELSLAM_BUILD_PYTHON) == ON ]]; then
  stage python3-gelslam python
  # A build that is to be installed elsewhere has another place for the module than Debian's packages.
  configured=$work/python3-gelslam/usr/$(cached GELSLAM_PYTHON_DIR) debian=$work/python3-gelslam/usr/lib/python3/dist-packages
  if [[ $configured != "$debian" ]]; then
    mkdir -p "$debian"
    mv "$configured/gelslam" "$debian/"
    rmdir -p --ignore-fail-on-non-empty "$configured"
  fi
  minor=$(basename "$debian"/gelslam/_core.cpython-3*.so | sed 's/.*cpython-3\([0-9]*\).*/\1/')
  mkdir "$work/python3-gelslam/DEBIAN"
  # What Python compiles beside the module goes with it.
  for step in "postinst py3compile" "prerm py3clean"; do
    printf '#!/bin/sh\nset -e\nif command -v %s >/dev/null; then %s -p python3-gelslam; fi\n' "${step#* }" "${step#* }" \
      >"$work/python3-gelslam/DEBIAN/${step% *}"
    chmod 755 "$work/python3-gelslam/DEBIAN/${step% *}"
  done
  finish python3-gelslam python "$(shared_libraries "$work/python3-gelslam"), python3 (>= 3.$minor), python3 (<< 3.$((minor + 1))), python3-numpy" "" <<'END'
tactile SLAM for camera-based touch sensors (Python module)
 Surfaces from tactile images, registration, tracking and reconstruction with
 NumPy arrays in and out: import gelslam.
END
else
  say "$build has no Python module (GELSLAM_BUILD_PYTHON); python3-gelslam is left out"
fi

$check || exit 0
say "lintian"
made=("$out"/*_"${version}_$architecture.deb")
lintian --fail-on error "${made[@]}"
say "installing and removing in a fresh root"
mmdebstrap --variant=apt --include=ca-certificates \
  --customize-hook="mkdir -p \$1/packages" --customize-hook="copy-in ${made[*]} /packages" \
  --chrooted-customize-hook='apt-get install -y --no-install-recommends /packages/gelslam_*.deb /packages/python3-gelslam_*.deb &&
    gelslam --version && gelslam simulate scan --object coin --frames 20 -o /tmp/log -q && gelslam reconstruct /tmp/log -o /tmp/run -q &&
    python3 -c "import gelslam; print(gelslam.read_run(\"/tmp/run\").trajectory.shape)" &&
    apt-get purge -y gelslam python3-gelslam && ! test -e /usr/bin/gelslam && ! test -e /usr/lib/python3/dist-packages/gelslam && ! test -e /lib/udev/rules.d/61-gelslam.rules' \
  "$(. /etc/os-release && echo "$VERSION_CODENAME")" /dev/null
say "installed, used and removed in a fresh root"
