#!/usr/bin/env bash
# Builds with a sanitizer, in a build folder of its own, and runs every test with it: gtests, the live node and
# nodelet on a bag, the experiments.
#   scripts/sanitize.sh thread    data races, misuse of locks
#   scripts/sanitize.sh address   memory errors, leaks, undefined behaviour
# Exit status 1 if a test fails or a sanitizer reports. scripts/sanitizers/ lists what is suppressed, and why.
# RIO_T_BUILD_DIR: the build folder, else build/thread/ or build/address/.
set -euo pipefail
kind=${1:-}
case "$kind" in
  -h | --help) sed -n '2,7s/^# \?//p' "$0"; exit 0 ;;
  thread) sanitizers=thread runtime=libtsan ;;
  address) sanitizers=address,undefined,float-cast-overflow runtime=libasan ;;
  *) echo "sanitize.sh: expected thread or address, not '$kind'" >&2; exit 1 ;;
esac
cd "$(dirname "$0")/.."
export PATH=/usr/bin:$PATH
export RIO_T_BUILD_DIR=${RIO_T_BUILD_DIR:-build/$kind}
suppressions=$PWD/scripts/sanitizers

# Without NDEBUG: Eigen checks its sizes and indices.
if [ ! -f "$RIO_T_BUILD_DIR/Makefile" ]; then
  scripts/build.sh -DRIO_T_SANITIZE="$sanitizers" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g"
fi
build=$(realpath "$RIO_T_BUILD_DIR")
reports=$build/reports
rm -rf "$reports" "$build/ros_logs"
mkdir -p "$reports"

# The manager of nodelets is not built with a sanitizer: it gets the runtime first, and our library at once, since
# the runtime names the functions only of what was there when it started.
export RIO_T_TEST_PRELOAD=$(realpath "$(gcc -print-file-name=$runtime.so)"):$build/devel/lib/librio_t_ros.so
export RIO_T_TEST_SLOWNESS=6 RIO_T_TEST_TIME_LIMIT=1400
# Exit statuses stay those of the programs, which tests look at; the reports count.
export TSAN_OPTIONS="log_path=$reports/thread suppressions=$suppressions/thread.txt history_size=4 exitcode=0 \
second_deadlock_stack=1 print_suppressions=0"
export ASAN_OPTIONS="log_path=$reports/address strict_string_checks=1 detect_stack_use_after_return=1"
export LSAN_OPTIONS="suppressions=$suppressions/leaks.txt print_suppressions=0"
# Beside the address sanitizer's, gcc's runtime for undefined behaviour writes to stderr whatever the log_path: its
# reports are looked for in what tests and, below rostest, nodes say.
export UBSAN_OPTIONS=print_stacktrace=1
export ROS_LOG_DIR=$build/ros_logs

passed=true
scripts/test.sh 2>&1 | tee "$build/test.log" || passed=false
{ grep -rhA 30 'runtime error: ' "$build/test.log" "$build/test_results" "$ROS_LOG_DIR" || true; } >"$reports/undefined"
[ -s "$reports/undefined" ] || rm "$reports/undefined"
if ! readelf -d "$build/devel/lib/librio_t_core.so" | grep -q "$runtime"; then
  echo "sanitize.sh: $build is not built with $sanitizers; remove it" >&2
  exit 1
fi
count=$(find "$reports" -type f | wc -l)
if [ "$count" -gt 0 ]; then
  grep -rhE '^SUMMARY|runtime error: ' "$reports" | sort | uniq -c | sort -rn >&2
  echo "sanitize.sh $kind: reports in $count files in $reports" >&2
  exit 1
fi
echo "sanitize.sh $kind: no report"
$passed
