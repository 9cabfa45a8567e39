#!/usr/bin/env bash
# Shows what rio_t does, from a bare clone: installs, builds, estimates, prints a short table, draws a report.
#   scripts/demo.sh               a simulated hand-held run, wild, with a random time offset that is shown only at
#                                 the end (RIO_T_DEMO_OFFSET=SECONDS sets the offset);
#                                 also the real bag, if $RIO_T_DATA_DIR (default ../shared/data) has it
#   scripts/demo.sh BAG [CONFIG]  your bag; CONFIG is irs (default), ti_mmwave or a YAML file
# Results go to results/.
set -euo pipefail
case "${1:-}" in -h | --help) sed -n '2,7s/^# \?//p' "$0"; exit 0 ;; esac
[ $# -le 2 ] || { echo "demo.sh: expected at most BAG and CONFIG" >&2; exit 1; }
bag=${1:+$(realpath -m -- "$1")}
if [ -n "$bag" ] && [ ! -f "$bag" ]; then
  echo "demo.sh: $bag: no such bag" >&2
  exit 1
fi
config=${2:-irs}
if [ -f "$config" ]; then config=$(realpath -- "$config"); fi

cd "$(dirname "$0")/.."
export PATH=/usr/bin:$PATH
build=${RIO_T_BUILD_DIR:-build}
data=${RIO_T_DATA_DIR:-../shared/data}
log=$(mktemp)
trap 'rm -f "$log"' EXIT
echo "Building (a few minutes the first time) ..."
scripts/build.sh --quiet
programs=$build/devel/lib/rio_t

# show NAME BAG CONFIG [TRUE_OFFSET [SETTING]]: one run, its table, its report.
show() {
  local name=$1 run_bag=$2 run_config=$3 true_offset=${4:-} setting=${5:-} folder=results/$1
  echo
  # 3: there is a result, but it is not to be trusted; the report says why.
  "$programs/rio_t_bag" --bag "$run_bag" --config "$run_config" --output-dir "$folder" ${setting:+--set "$setting"} || [ $? -eq 3 ]
  if [ -n "$true_offset" ]; then
    awk -v s="$true_offset" '/^final_offset_s:/ {
      printf "  %-16s%.2f ms, drawn and not told to the estimator: it is %.2f ms off\n", "true offset", 1000 * s, 1000 * ($2 - s)
    }' "$folder/summary.yaml"
  fi
  if [ -f scripts/report.py ]; then
    local options=()
    [ -z "$true_offset" ] || options+=(--true-offset "$true_offset" --ground-truth "results/$name.truth.txt")
    if python3 scripts/report.py --evaluate "$programs/evaluate" "${options[@]}" "$folder" >"$log" 2>&1; then
      echo "  report          $folder/report/report.html"
    else
      echo "  report          not drawn: $(tail -n 1 "$log")"
    fi
  fi
}

mkdir -p results
if [ -n "$bag" ]; then
  show "$(basename "$bag" .bag)" "$bag" "$config"
  exit 0
fi

# From -20 ms (stamps too early) to 100 ms (late, as of a slow bus).
offset=${RIO_T_DEMO_OFFSET:-$(awk -v r="$RANDOM" 'BEGIN { printf "%.5f", -0.02 + 0.12 * r / 32767 }')}
"$programs/simulate" --motion difficult --time-offset "$offset" --seed 7 --out results/simulated.bag \
  --ground-truth results/simulated.truth.txt >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
show simulated results/simulated.bag irs "$offset"

real=$data/real/ti_mmwave_rospkg_demo.bag
if [ -f "$real" ]; then
  # The mounting that came with this bag is about 7 degrees and 15 cm off; the estimate finds it.
  show real "$real" ti_mmwave "" estimate_extrinsics=pose
else
  echo
  echo "No real bag at $real; set RIO_T_DATA_DIR to the folder that holds real/ti_mmwave_rospkg_demo.bag to run it too."
fi
