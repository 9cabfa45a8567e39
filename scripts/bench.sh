#!/usr/bin/env bash
# Builds, then measures what a bag costs: speed in times real time, CPU seconds, memory, allocations, and each stage's share.
#   scripts/bench.sh BAG CONFIG [--runs N] [--json FILE] [--compare OTHER] [--set key=value]...
#   scripts/bench.sh growth [--json FILE]   cost against window, points, IMU rate and length of the bag
#   scripts/bench.sh micro [OPTION]...      the parts one by one (options of Google benchmark)
# OTHER is another build folder, or a revision of git (built on the first call). The runs of both alternate; it prints the ratios.
set -euo pipefail
case "${1:-}" in '' | -h | --help) sed -n '2,6s/^# \?//p' "$0"; exit 0 ;; esac
folder=$(pwd)
cd "$(dirname "$0")/.."
export PATH=/usr/bin:$PATH
log=$(mktemp)
trap 'rm -f "$log"' EXIT
build=$(realpath -m -- "${RIO_T_BUILD_DIR:-build}")
scripts/build.sh --quiet
if ! cmake --build "$build" --parallel "$(nproc)" --target rio_t_benchmarks >"$log" 2>&1; then
  tail -n 30 "$log" >&2
  echo "bench.sh: the build failed, see above" >&2
  exit 1
fi
repository=$(pwd)
cd "$folder"
case "$1" in
  micro) shift; "$build/devel/lib/rio_t/micro_benchmark" "$@" ;;
  growth) shift; python3 "$repository/bench/growth.py" --programs "$build/devel/lib/rio_t" "$@" ;;
  *) python3 "$repository/bench/bench.py" --programs "$build/devel/lib/rio_t" --repository "$repository" "$@" ;;
esac
