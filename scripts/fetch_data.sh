#!/usr/bin/env bash
# Fetches the public recordings that docs/results.md uses and checks them. It changes nothing else.
#   scripts/fetch_data.sh [DIR]   puts them into DIR (default data/); then: export RIO_T_DATA_DIR=DIR
# The sets of the IRS (gigabytes) are behind web pages. The script prints those.
set -euo pipefail
case "${1:-}" in -h | --help) sed -n '2,4s/^# \?//p' "$0"; exit 0 ;; esac
[ $# -le 1 ] || { echo "fetch_data.sh: expected at most a folder" >&2; exit 2; }
folder=${1:-$(dirname "$0")/../data}

# The demo recording of EKF-RIO: 40 s, ADIS16448 and TI IWR6843AOP. The commit is part of the address, so the bytes cannot change.
name=ti_mmwave_rospkg_demo.bag
url=https://github.com/christopherdoer/rio/raw/c1472143f6c996611a981ae4a663d2239d5c850e/demo_datasets/$name
sha256=d19e37130d0f1682d6f9323bdbbbff45cb7f136ed09a441347c49d923783a661

command -v curl >/dev/null || { echo "fetch_data.sh: curl is missing; install it, or fetch $url by hand" >&2; exit 1; }
mkdir -p "$folder/real"
bag=$folder/real/$name
matches() { echo "$sha256  $1" | sha256sum --check --status; }

if [ -f "$bag" ] && matches "$bag"; then
  echo "$bag is there."
else
  echo "Fetching $bag ..."
  curl --fail --location --silent --show-error --output "$bag.part" "$url" || {
    rm -f "$bag.part"
    echo "fetch_data.sh: could not fetch $url" >&2
    exit 1
  }
  matches "$bag.part" || {
    echo "fetch_data.sh: $bag.part is not the file it should be (sha256 $(sha256sum "$bag.part" | cut -d' ' -f1), expected $sha256)" >&2
    exit 1
  }
  mv "$bag.part" "$bag"
fi

cat <<TEXT

Larger sets, to be fetched by hand from their pages (we know no checksums of them); all run with --config irs:
  IRS, motion capture and outdoors   https://christopherdoer.github.io/datasets/irs_rtvi_datasets_iros2021
  carried and flights                https://christopherdoer.github.io/datasets/icins_2021_radar_inertial_odometry
  several radars                     https://christopherdoer.github.io/datasets/multi_radar_inertial_datasets_JGN2022

Now:
  export RIO_T_DATA_DIR=$(realpath "$folder")
  devel/lib/rio_t/rio_t_bag $(realpath "$bag") --config ti_mmwave
TEXT
