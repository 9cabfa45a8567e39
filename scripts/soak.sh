#!/usr/bin/env bash
# Builds, then plays simulated data to the live node for long, at high speed: memory must stay flat after the first
# minute and latency must not drift. Prints the numbers, draws them; exit status 1 if one of them grows.
#   scripts/soak.sh [MINUTES_OF_DATA] [--rate R] [--output-dir DIR]      defaults: 60, 10, results/soak
set -euo pipefail
case "${1:-}" in -h | --help) sed -n '2,4s/^# \?//p' "$0"; exit 0 ;; esac
folder=$(pwd)
cd "$(dirname "$0")/.."
export PATH=/usr/bin:$PATH
build=$(realpath -m -- "${RIO_T_BUILD_DIR:-build}")
soak=$(pwd)/bench/soak.py
python3 "$soak" --check "$@"  # a wrong argument is told before the build
scripts/build.sh --quiet
set +u  # catkin's own hooks read variables that a shell without ROS does not have
source "$build/devel/setup.bash"
set -u
cd "$folder"
python3 "$soak" "$@"
