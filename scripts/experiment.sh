#!/usr/bin/env bash
# Builds, then runs one of the paper's experiments. scripts/experiment.sh --help lists them and their options.
set -euo pipefail
scripts=$(cd "$(dirname "$0")" && pwd)
export PATH=/usr/bin:$PATH
# A wrong argument is told before the build, not after it.
python3 "$scripts/experiment.py" --check "$@"
for word in "$@"; do
  case "$word" in -h | --help) exit 0 ;; esac
done
"$scripts/build.sh" --quiet
build=$(cd "$scripts/.." && realpath -m -- "${RIO_T_BUILD_DIR:-build}")
python3 "$scripts/experiment.py" "$@" --programs "$build/devel/lib/rio_t"
