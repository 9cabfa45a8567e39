#!/usr/bin/env bash
# Installs what is missing and builds rio_t into build/ (Release). Arguments go to cmake.
# Afterwards: source build/devel/setup.bash
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH=/usr/bin:$PATH  # catkin belongs to the system's python

scripts/install_dependencies.sh
build=${RIO_T_BUILD_DIR:-build}
# The generated message headers depend on the whole configuration: configure only when it is new or told to.
if [ ! -f "$build/Makefile" ] || [ $# -gt 0 ]; then
  cmake -S . -B "$build" -DCMAKE_BUILD_TYPE=Release -DPYTHON_EXECUTABLE=/usr/bin/python3 \
    -DPython3_EXECUTABLE=/usr/bin/python3 "$@" >"${TMPDIR:-/tmp}/rio_t_cmake.log" 2>&1 || {
    cat "${TMPDIR:-/tmp}/rio_t_cmake.log" >&2; exit 1; }
fi
cmake --build "$build" --parallel "$(nproc)"
