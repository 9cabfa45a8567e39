#!/usr/bin/env bash
# Installs, builds and runs every test; ends with one line that counts them. Exit status 1 if one fails.
set -uo pipefail
case "${1:-}" in -h | --help) sed -n '2s/^# \?//p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/.."
export PATH=/usr/bin:$PATH
build=${RIO_T_BUILD_DIR:-build}

scripts/build.sh || exit 1
cmake --build "$build" --parallel "$(nproc)" --target tests || exit 1
set +u  # catkin's own hooks read variables that a shell without ROS does not have
source "$build/devel/setup.bash"
set -u
rm -rf "$build/test_results"
RIO_T_DATA_DIR=$(realpath -m "${RIO_T_DATA_DIR:-../shared/data}")
export RIO_T_DATA_DIR
tested=true  # a program that hangs has no results to count
(cd "$build" && ctest --output-on-failure --parallel "$(nproc)" --exclude-regex _rostest_) || tested=false
# These run live, each with a roscore and several nodes.
(cd "$build" && ctest --output-on-failure --tests-regex _rostest_) || tested=false
# Programs of others, which use what is installed, cannot load libraries with a sanitizer.
installed=true
[ -n "${RIO_T_TEST_PRELOAD:-}" ] || scripts/test_install.sh || installed=false
python3 scripts/count_tests.py "$build/test_results" && $installed && $tested
