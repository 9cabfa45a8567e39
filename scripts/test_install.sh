#!/usr/bin/env bash
# Installs what scripts/build.sh built, for the duration of the test, into its folder install/, puts the sources and the rest of the build out of reach,
# and runs test/install/install_test.py: programs, launch files, nodelet, Python, and a package that uses the libraries.
# RIO_T_BUILD_DIR: the build folder, else build/.
set -euo pipefail
case "${1:-}" in -h | --help) sed -n '2,4s/^# \?//p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/.."
export PATH=/usr/bin:$PATH
source=$(pwd)
build=$(realpath -m -- "${RIO_T_BUILD_DIR:-build}")
temporary=$(mktemp -d)
trap 'rm -rf "$temporary"' EXIT

prefix=$(sed -n 's/^CMAKE_INSTALL_PREFIX:PATH=//p' "$build/CMakeCache.txt")
if [ "$prefix" != "$build/install" ]; then
  echo "test_install.sh: $build installs into $prefix, expected $build/install: remove the build folder and build again" >&2
  exit 1
fi

# Never inside of the sources: roslaunch would find each launch file twice. In the namespace the folder comes to its prefix.
installed=$temporary/destination$build/install
DESTDIR=$temporary/destination cmake --build "$build" --target install >"$temporary/install.log" 2>&1 || { tail -n 30 "$temporary/install.log" >&2; exit 1; }
cp -r test/install "$temporary/tests"
results=$build/test_results/rio_t
mkdir -p "$results"

# In a mount namespace of its own, where empty folders cover the sources and the build; all ends with it.
namespace=(unshare --mount)
[ "$(id -u)" -eq 0 ] || namespace+=(--map-root-user)
if ! "${namespace[@]}" true 2>/dev/null; then
  echo "test_install.sh: this system lets nobody hide folders (unshare --mount): the sources stay in reach" >&2
  namespace=()
  [ ! -e "$build/install" ] || { echo "test_install.sh: $build/install is in the way" >&2; exit 1; }
  trap 'rm -rf "$temporary" "$build/install"' EXIT
  cp -r "$installed" "$build/install"
fi
RIO_T_HIDDEN=${namespace:+yes} "${namespace[@]}" bash -euc '
  source=$1 build=$2 temporary=$3 installed=$4
  if [ -n "$RIO_T_HIDDEN" ]; then
    mkdir "$temporary/results"
    mount --bind "$build/test_results/rio_t" "$temporary/results"
    mount -t tmpfs none "$build"
    mount -t tmpfs none "$source"
    mkdir -p "$build/install" "$build/test_results/rio_t"
    mount --bind "$installed" "$build/install"
    mount --bind "$temporary/results" "$build/test_results/rio_t"
  fi
  cd "$temporary"
  set +u  # hooks of catkin read variables that a shell without ROS does not have
  source "$build/install/setup.bash"
  export RIO_T_TEST_SOURCE=$source RIO_T_TEST_BUILD=$build
  python3 -m pytest -p no:cacheprovider -q --junit-xml="$build/test_results/rio_t/install.xml" tests/install_test.py
' test_install "$source" "$build" "$temporary" "$installed"
