#!/usr/bin/env bash
# Builds this tree and runs every test in another system, in a folder that debootstrap makes.
#   scripts/test_system.sh SUITE             scripts/test.sh there. SUITE is bullseye, bookworm or trixie (Debian 11, 12, 13), or jammy (Ubuntu 22.04)
#   scripts/test_system.sh SUITE COMMAND...  runs COMMAND instead, in the tree, e.g. a shell
# It needs root, debootstrap and 6 GB. The first run takes about an hour on two cores. The folder keeps its packages and its
# build, and later runs build only what changed. The tree is visible read-only inside, and every mount ends with the script.
# RIO_T_SYSTEMS_DIR: where the folders are, else /var/tmp/rio_t_systems. RIO_T_MIRROR: else deb.debian.org or archive.ubuntu.com.
set -euo pipefail
suite=${1:-}
case "$suite" in
  -h | --help) sed -n '2,7s/^# \?//p' "$0"; exit 0 ;;
  bullseye | bookworm | trixie) mirror=http://deb.debian.org/debian components=main ;;
  jammy) mirror=http://archive.ubuntu.com/ubuntu components=main,universe ;;
  *) echo "test_system.sh: expected bullseye, bookworm, trixie or jammy, not '$suite'" >&2; exit 1 ;;
esac
shift
[ "$(id -u)" -eq 0 ] || { echo "test_system.sh: must run as root, to mount and to change the root folder" >&2; exit 1; }
command -v debootstrap >/dev/null || { echo "test_system.sh: debootstrap is missing: apt-get install debootstrap" >&2; exit 1; }

source=$(cd "$(dirname "$0")/.." && pwd)
root=${RIO_T_SYSTEMS_DIR:-/var/tmp/rio_t_systems}/$suite
data=${RIO_T_DATA_DIR:-$(realpath -m "$source/../shared/data")}

# The last step that makes the folder writes the mark: a folder that was interrupted starts again.
if [ ! -f "$root/.rio_t_complete" ]; then
  echo "test_system.sh: making $root"
  mkdir -p "$root"
  log=$root.log
  debootstrap --variant=minbase --include=ca-certificates --components="$components" "$suite" "$root" \
    "${RIO_T_MIRROR:-$mirror}" >"$log" 2>&1 || { tail -n 20 "$log" >&2; exit 1; }
  mkdir -p "$root"/{rio_t,data,build,ccache}
  # The folder need not survive a power cut and needs no manuals.
  printf '%s\n' force-unsafe-io 'path-exclude=/usr/share/doc/*' 'path-exclude=/usr/share/man/*' >"$root/etc/dpkg/dpkg.cfg.d/rio_t"
  touch "$root/.rio_t_complete"
fi
# roslaunch asks for the addresses of localhost and of the machine; debootstrap makes no file with them.
cp /etc/hosts /etc/resolv.conf "$root/etc/"
echo "127.0.0.1 localhost $(hostname)" >>"$root/etc/hosts"

# In namespaces of its own: all mounts and processes end with unshare, on Ctrl-C too. From elsewhere, stop unshare with
# kill -KILL: it ignores a plain kill, and goes on if only this script is killed.
inside=(unshare --mount --pid --fork --kill-child -- bash -euc '
  root=$1 source=$2 data=$3
  shift 3
  mount --make-rprivate /
  mount -t proc proc "$root/proc"
  mkdir -p "$root/dev/shm" "$root/dev/pts"
  mount -t tmpfs tmpfs "$root/dev/shm"
  mount --bind /dev/pts "$root/dev/pts"
  mount -t tmpfs tmpfs "$root/tmp"
  mount --bind "$source" "$root/rio_t"
  mount -o remount,ro,bind "$root/rio_t"
  if [ -d "$data" ]; then
    mount --bind "$data" "$root/data"
    mount -o remount,ro,bind "$root/data"
  fi
  exec chroot "$root" env -i HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin TERM="${TERM:-dumb}" \
    RIO_T_WERROR=ON RIO_T_BUILD_DIR=/build RIO_T_DATA_DIR=/data PYTHONDONTWRITEBYTECODE=1 CCACHE_DIR=/ccache \
    CMAKE_CXX_COMPILER_LAUNCHER=ccache bash -euc '\''cd /rio_t && "$@"'\'' inside "$@"
' inside "$root" "$source" "$data")
"${inside[@]}" scripts/install_dependencies.sh ccache
[ $# -gt 0 ] || set -- scripts/test.sh
"${inside[@]}" "$@"
