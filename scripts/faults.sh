#!/usr/bin/env bash
# Builds, then runs the fault campaign. scripts/faults.sh --help lists its options.
set -euo pipefail
scripts=$(cd "$(dirname "$0")" && pwd)
export PATH=/usr/bin:$PATH PYTHONDONTWRITEBYTECODE=1
for word in "$@"; do
  case "$word" in -h | --help | --list) exec python3 "$scripts/faults.py" "$@" ;; esac
done
# Wrong options are told before the build, not after it; the cases need what the build installs.
python3 "$scripts/faults.py" --check "$@"
"$scripts/build.sh" --quiet
build=$(cd "$scripts/.." && realpath -m -- "${RIO_T_BUILD_DIR:-build}")
set +u  # catkin's own hooks read variables that a shell without ROS does not have
source "$build/devel/setup.bash"
set -u
export RIO_T_DATA_DIR=${RIO_T_DATA_DIR:-$(realpath -m "$scripts/../../shared/data")}
python3 "$scripts/faults.py" "$@" --programs "$build/devel/lib/rio_t"
