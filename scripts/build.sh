#!/usr/bin/env bash
# Installs what is missing and builds rio_t into build/ (Release). Arguments go to cmake.
#   scripts/build.sh --quiet [ARGUMENT...]   shows what it installs, and of the build only errors
# Afterwards: source devel/setup.bash
# RIO_T_BUILD_DIR: the build folder, else build/. Any other build folder has the devel space inside. RIO_T_WERROR=ON: warnings are errors.
set -euo pipefail
case "${1:-}" in -h | --help) sed -n '2,5s/^# \?//p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/.."
export PATH=/usr/bin:$PATH  # catkin belongs to the system's python
quiet=false
if [ "${1:-}" = --quiet ]; then
  quiet=true
  shift
fi
build=${RIO_T_BUILD_DIR:-build}
# rosrun does not look into the folder build/ of a package: the devel space is beside it, as in a catkin workspace.
devel=$(realpath -m "$build")/devel
if [ -z "${RIO_T_BUILD_DIR:-}" ] && { [ -L build/devel ] || [ ! -e build/devel ]; }; then
  devel=$PWD/devel
  mkdir -p build devel
  ln -sfn ../devel build/devel
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT

# Runs a command, and shows the end of what it says only if it fails.
step() {
  if "$@" >"$log" 2>&1; then return; fi
  tail -n 30 "$log" >&2
  echo "build.sh: the build failed, see above" >&2
  exit 1
}

scripts/install_dependencies.sh
# The generated message headers depend on the whole configuration: configure only when it is new or told to.
if [ ! -f "$build/Makefile" ] || [ $# -gt 0 ]; then
  step cmake -S . -B "$build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$(realpath -m "$build")/install" -DCATKIN_DEVEL_PREFIX="$devel" \
    -DPYTHON_EXECUTABLE=/usr/bin/python3 \
    -DPython3_EXECUTABLE=/usr/bin/python3 -DRIO_T_WERROR="${RIO_T_WERROR:-OFF}" "$@"
elif [ -n "${RIO_T_WERROR:-}" ] && ! grep -qx "RIO_T_WERROR:BOOL=$RIO_T_WERROR" "$build/CMakeCache.txt"; then
  step cmake -DRIO_T_WERROR="$RIO_T_WERROR" "$build"
fi
make=(cmake --build "$build" --parallel "$(nproc)")
if $quiet; then step "${make[@]}"; else "${make[@]}"; fi
