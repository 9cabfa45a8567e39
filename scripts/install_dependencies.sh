#!/usr/bin/env bash
# Installs with apt what is missing to build, test and run rio_t on Debian 12, and the packages given as arguments.
# Does nothing when all is there.
set -euo pipefail

packages=(
  build-essential cmake catkin python3-ament-package
  libroscpp-dev librosconsole-dev librospack-dev libxmlrpcpp-dev librosbag-dev librosbag-storage-dev
  libnodelet-dev libnodeletlib-dev pluginlib-dev
  libstd-msgs-dev libstd-srvs-dev libsensor-msgs-dev libgeometry-msgs-dev libnav-msgs-dev libdiagnostic-msgs-dev
  libdiagnostic-updater-dev libdynamic-reconfigure-config-init-mutex-dev libtf2-dev libtf2-eigen-dev libtf2-ros-dev libpcl-dev libboost-dev
  ros-message-generation ros-message-runtime ros-std-msgs libeigen3-dev libceres-dev libyaml-cpp-dev
  librostest-dev libgtest-dev libbenchmark-dev
  # rosrun, rosbag play, the nodelet manager, rviz, and messages for Python: rostopic echo and the rostests
  rosbash rospack-tools python3-roslaunch python3-rosbag python3-rostest python3-rostopic python3-rosservice rosout libnodeletlib-tools rviz
  python3-nav-msgs python3-diagnostic-msgs python3-std-srvs python3-tf2-msgs python3-sensor-msgs python3-nodelet
  python3-dynamic-reconfigure libdiagnostic-aggregator-tools ros-robot-state-publisher
  python3-numpy python3-matplotlib python3-scipy python3-tqdm python3-yaml python3-setuptools python3-pytest
)

packages+=("$@")  # what the calling script needs besides

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

if ! command -v apt-get >/dev/null; then
  echo "install_dependencies: no apt-get here; install by hand: ${missing[*]}" >&2
  exit 1
fi
as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)
echo "Installing ${#missing[@]} packages: ${missing[*]}"
log=$(mktemp)
if ! { "${as_root[@]}" apt-get update && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
       apt-get install -y --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
  tail -n 20 "$log" >&2
  echo "install_dependencies: apt-get failed, whole log in $log" >&2
  exit 1
fi
rm -f "$log"
