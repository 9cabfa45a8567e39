#!/usr/bin/env bash
# Fuzzes the decoding of point clouds, the reading of parameter files and the odometry, side by side, with the address
# and undefined behaviour sanitizers (clang's libFuzzer).
#   scripts/fuzz.sh [SECONDS]    runs for that long [600]
# It starts from fuzz/corpus/ and keeps new inputs in a temporary folder. If an input breaks something, the script keeps it
# in build/fuzz/findings/, names it, and ends with exit status 1.
# RIO_T_BUILD_DIR: the build folder, else build/fuzz/.
set -euo pipefail
case "${1:-}" in -h | --help) sed -n '2,7s/^# \?//p' "$0"; exit 0 ;; esac
seconds=${1:-600}
if ! [[ $seconds =~ ^[1-9][0-9]*$ ]]; then
  echo "fuzz.sh: expected a number of seconds, not '$seconds'" >&2
  exit 1
fi
cd "$(dirname "$0")/.."
export PATH=/usr/bin:$PATH
build=${RIO_T_BUILD_DIR:-build/fuzz}
scratch=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null && wait; rm -rf "$scratch"' EXIT  # with the fuzzers, if it is stopped

scripts/install_dependencies.sh clang-14 libclang-rt-14-dev
if [ ! -f "$build/Makefile" ]; then
  CC=clang-14 CXX=clang++-14 cmake -S . -B "$build" -DRIO_T_FUZZ=ON -DCATKIN_ENABLE_TESTING=OFF \
    -DRIO_T_SANITIZE=address,undefined,float-cast-overflow,fuzzer-no-link -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g" -DPYTHON_EXECUTABLE=/usr/bin/python3 \
    -DPython3_EXECUTABLE=/usr/bin/python3 >"$scratch/cmake.log" 2>&1 || { cat "$scratch/cmake.log" >&2; exit 1; }
fi
cmake --build "$build" --parallel "$(nproc)" --target rio_t_point_cloud_fuzzer rio_t_parameters_fuzzer \
  rio_t_odometry_fuzzer >"$scratch/make.log" 2>&1 ||
  { tail -n 40 "$scratch/make.log" >&2; exit 1; }
programs=$build/devel/lib/rio_t
findings=$build/findings
mkdir -p "$findings"

# Every key and every word of the configuration, for the parameter files.
grep -ohE '[A-Za-z_][A-Za-z0-9_/.]+|[-0-9][0-9.e-]*' config/*.yaml | sort -u | sed 's/.*/"&"/' >"$scratch/words"

# fuzz NAME OPTION...: becomes the fuzzer. The corpora given follow the one that grows.
fuzz() {
  local name=$1
  shift
  mkdir -p "$scratch/$name"
  exec "$programs/${name}_fuzzer" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 \
    -artifact_prefix="$findings/$name-" "$scratch/$name" "fuzz/corpus/$name" "$@" >"$scratch/$name.log" 2>&1
}
export UBSAN_OPTIONS=print_stacktrace=1
fuzz point_cloud -max_len=2048 & first=$!
fuzz parameters config -max_len=2048 -dict="$scratch/words" & second=$!
fuzz odometry -max_len=16384 & third=$!
clean=true
for run in "point_cloud $first" "parameters $second" "odometry $third"; do
  read -r name id <<<"$run"
  if ! wait "$id"; then
    clean=false
    tail -n 60 "$scratch/$name.log" >&2
  fi
  awk -v name="$name" '/stat::number_of_executed_units/ { n = $2 } / cov: / { c = $0; sub(/.* cov: /, "", c); sub(/ .*/, "", c) }
    END { printf "%-12s %d executions, %d edges reached\n", name, n, c }' "$scratch/$name.log"
done
if ! $clean; then
  echo "fuzz.sh: finding in $findings, report above" >&2
  exit 1
fi
echo "fuzz.sh: $seconds s each, no finding"
