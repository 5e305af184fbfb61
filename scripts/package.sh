#!/usr/bin/env bash
# usage: scripts/package.sh [--build DIR] [--check] [OUT]
#
# Makes Debian packages for this system (Debian 12 or 13, Ubuntu 24.04) in OUT (default: packages in the repository):
#   gelslam           the program, its manual pages, shell completion, udev rule, desktop entry, documentation,
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
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# debhelper works in the folder that holds debian/.
DEB_HOST_ARCH=$(dpkg --print-architecture)
SOURCE_DATE_EPOCH=$(git -C "$root" log -1 --format=%ct 2>/dev/null || date +%s)
export DEB_HOST_ARCH SOURCE_DATE_EPOCH
mkdir -p "$out"
cp -r "$root/packaging/debian" "$work/"
cd "$work"
cat >debian/changelog <<END
gelslam ($version) unstable; urgency=medium

  * See CHANGELOG.md in the documentation of the package gelslam.

 -- $(sed -n 's/^Maintainer: //p' debian/control)  $(date -R -d "@$SOURCE_DATE_EPOCH")
END
{ echo "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/"
  printf '\nFiles: *\nCopyright: 2026 The GelSLAM authors\nLicense: Expat\n'
  sed -n '/^Permission/,$p' "$root/LICENSE" | sed 's/^$/./; s/^/ /'; } >debian/copyright
cp "$root/packaging/61-gelslam.rules" debian/gelslam.udev

parts=(gelslam:runtime libgelslam-dev:development python3-gelslam:python)
if [[ $(cached GELSLAM_BUILD_PYTHON) != ON ]]; then
  say "$build has no Python module (GELSLAM_BUILD_PYTHON); python3-gelslam is left out"
  unset 'parts[2]'
  export DH_OPTIONS=-Npython3-gelslam
fi
for part in "${parts[@]}"; do
  DESTDIR=$work/debian/${part%:*} cmake --install "$build" --prefix /usr --component "${part#*:}" >/dev/null
done
share=debian/gelslam/usr/share
install -Dm644 "$root/packaging/gelslam.bash-completion" "$share/bash-completion/completions/gelslam"
install -Dm644 "$root/packaging/gelslam.desktop" -t "$share/applications"
install -Dm644 "$root/packaging/gelslam.svg" -t "$share/icons/hicolor/scalable/apps"

# manual_page [COMMAND...]: of a command and of those below it, from their help.
manual_page() {
  local name help command
  name=$(IFS=- && echo "gelslam${*:+-$*}")
  help=$("$build/bin/gelslam" "$@" --help)
  help2man --no-info --version-string="$version" --name="${help%%$'\n'*}" "$build/bin/gelslam${*:+ $*}" |
    sed "/^\.SH NAME/{n;s/^gelslam $* /$name /}" >"$name.1"
  while read -r command; do
    manual_page "$@" "$command"
  done < <(sed -n '/^Subcommands:/,/^$/s/^  \([a-z]*\) .*/\1/p' <<<"$help")
}
manual_page

dh_installman -pgelslam ./*.1
dh_installudev --priority=61
dh_installchangelogs
dh_compress
dh_installdocs
# README, pages and examples, beside each other as in the repository, so that their links hold.
(cd "$root" && find README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md CITATION.cff docs examples configs -type f -not -name '*.pyc' \
  -exec install -Dm644 {} "$work/$share/doc/gelslam/{}" \;)
dh_python3
dh_strip --no-automatic-dbgsym
dh_fixperms
dh_shlibdeps -- --ignore-missing-info
dh_installdeb
dh_gencontrol
dh_md5sums
dh_builddeb --destdir="$out" -- -Zxz -z1

$check || exit 0
say "lintian"
made=("$out"/*_"${version}_$DEB_HOST_ARCH.deb")
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
