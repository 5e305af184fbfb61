#!/usr/bin/env bash
# Builds and tests in a root of Debian 13: see usage below.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

usage() {
  cat <<END
usage: scripts/try_debian13.sh [ROOT [COMMAND...]]

Makes a Debian 13 in the folder ROOT (default: gelslam-debian13 in \$XDG_CACHE_HOME, else in /var/tmp), unless an earlier
run made it, with the mirror and the proxies of this system's apt. Copies the repository's files into it, and runs there
the demo, all tests, scripts/build_wheel.sh and scripts/package.sh. With COMMAND, runs only that, in the repository's
copy: /gelslam. Needs root, debootstrap and 6 GB. Tests on virtual cameras are left out.
Its mounts are seen by this script alone and end with it. rm -rf ROOT removes everything.
END
}

case ${1:-} in
  -h | --help) usage; exit 0 ;;
  -*) usage >&2; exit 2 ;;
esac
say() { echo "try_debian13: $*"; }
fail() { say "$*" >&2; exit 2; }

root=$(realpath -m "${1:-${XDG_CACHE_HOME:-/var/tmp}/gelslam-debian13}")
shift $(($# > 0 ? 1 : 0))
[[ $root/ != "$repository"/* ]] || fail "$root lies in the repository; name a folder outside"
((EUID == 0)) || fail "run this as root: it mounts and changes the root folder"
command -v debootstrap >/dev/null || fail "debootstrap is missing: apt-get install debootstrap"
[[ ! -e $root || -f $root/.gelslam-debian13 ]] || fail "$root exists, and was not made by this script"

# A mount namespace of its own: no mount is left behind, however this ends.
if [[ ${GELSLAM_OWN_MOUNTS:-} != $$ ]]; then
  exec env GELSLAM_OWN_MOUNTS=$$ unshare --mount --propagation private "$0" "$root" "$@"
fi

# The mirror that this system's apt uses: of Debian itself, and of its security updates.
mirror_of() {
  apt-get indextargets --format '$(LABEL) $(REPO_URI)' "Created-By: Packages" | sed -n "s/^$1 //p" | head -n1
}

make_root() {
  local mirror security
  mirror=$(mirror_of Debian)
  security=$(mirror_of Debian-Security)
  [[ -n $mirror ]] || fail "this system's apt has no Debian mirror (apt-get update first?)"
  say "making a Debian 13 from $mirror in $root"
  mkdir -p "$root"
  touch "$root/.gelslam-debian13" "$root/.incomplete"
  eval "$(apt-config shell http_proxy Acquire::http::Proxy https_proxy Acquire::https::Proxy)"
  export http_proxy=${http_proxy-} https_proxy=${https_proxy-}
  debootstrap --variant=minbase --include=ca-certificates trixie "$root" "$mirror"
  { echo "deb $mirror trixie main"
    echo "deb $mirror trixie-updates main"
    [[ -z $security ]] || echo "deb $security trixie-security main"; } >"$root/etc/apt/sources.list"
  rm -f "$root"/etc/apt/sources.list.d/*.sources
  apt-config dump | grep -E '^Acquire::(https?::|Retries|Check-|ForceIPv)' >"$root/etc/apt/apt.conf.d/01this-system" || true
  rm "$root/.incomplete"
}

copy_repository() {
  mkdir -p "$root/gelslam"
  find "$root/gelslam" -mindepth 1 -maxdepth 1 -not -name build -not -name demo -not -name packages -exec rm -rf {} +
  # Also files that are not committed yet. Times are kept, so that only what changed is compiled again.
  (cd "$repository" && git ls-files -z --cached --others --exclude-standard | tar --create --null --ignore-failed-read --files-from=-) |
    tar --extract --directory "$root/gelslam" --no-same-owner
}

mount_all() {
  mount -t proc proc "$root/proc"
  mount --rbind /dev "$root/dev"
  mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
  cp /etc/resolv.conf /etc/hosts "$root/etc/"
  local data=${GELSLAM_DATA:-$repository/../shared/data}
  if [[ -d $data ]]; then
    mkdir -p "$root/data"
    mount --bind -o ro "$data" "$root/data"
  fi
}

inside() {
  local variables=(PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 TERM="${TERM:-dumb}"
    GELSLAM_DATA=/data GELSLAM_WERROR=ON DEBIAN_FRONTEND=noninteractive)
  local name
  for name in http_proxy https_proxy no_proxy; do [[ -z ${!name:-} ]] || variables+=("$name=${!name}"); done
  env -i "${variables[@]}" chroot "$root" sh -c 'cd /gelslam && exec "$@"' sh "$@"
}

if [[ ! -e $root || -e $root/.incomplete ]]; then make_root; fi
copy_repository
mount_all
if (($# > 0)); then
  inside "$@"
  exit
fi
inside apt-get update -qq
inside ./scripts/setup.sh --tests --packages
inside ./scripts/demo.sh
inside ./scripts/test.sh
inside ./scripts/build_wheel.sh --build build
inside ./scripts/package.sh --build build
say "demo, tests, wheel and packages are made: $root/gelslam"
