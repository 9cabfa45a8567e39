#!/usr/bin/env bash
# Installs with apt what is missing to build, test and run rio_t on Debian 11, 12 or 13 or Ubuntu 22.04, and the
# packages given as arguments. It says what it will install. On a terminal it asks before it uses sudo. If all is there it does nothing.
#
# On a machine with another ROS (a folder in /opt/ros) or another system it installs nothing: there Debian's packages of
# ROS may remove the ROS that is installed. It then checks what package.xml asks for with rosdep. Exit status 0 if all
# is there, else 3 with the lines to type.
# For tests: RIO_T_SYSTEM_ROOT stands for /, where os-release and /opt/ros are looked for.
set -euo pipefail
case "${1:-}" in -h | --help) sed -n '2,8s/^# \?//p' "$0"; exit 0 ;; esac
system=${RIO_T_SYSTEM_ROOT:-}
repository=$(cd "$(dirname "$0")/.." && pwd)
ros_1='melodic|noetic|one'

packages=(
  build-essential cmake catkin
  libroscpp-dev librosconsole-dev libxmlrpcpp-dev librosbag-dev librosbag-storage-dev
  libnodelet-dev libnodeletlib-dev pluginlib-dev
  libstd-msgs-dev libstd-srvs-dev libsensor-msgs-dev libgeometry-msgs-dev libnav-msgs-dev libdiagnostic-msgs-dev
  libdiagnostic-updater-dev libdynamic-reconfigure-config-init-mutex-dev libtf2-dev libtf2-eigen-dev libtf2-ros-dev
  libtf2-msgs-dev libpcl-dev libpcl-conversions-dev libboost-dev libboost-program-options-dev libtopic-tools-dev
  ros-message-generation ros-message-runtime ros-std-msgs libeigen3-dev libceres-dev libyaml-cpp-dev
  librostest-dev libgtest-dev libbenchmark-dev
  # rosrun, rosbag play, the nodelet manager, rviz, and messages for Python: rostopic echo and the rostests
  rosbash rospack-tools python3-roslaunch python3-rosbag python3-rostest python3-rostopic python3-rosservice rosout libnodeletlib-tools rviz
  python3-nav-msgs python3-diagnostic-msgs python3-std-srvs python3-tf2-msgs python3-sensor-msgs python3-rosgraph-msgs python3-nodelet
  python3-dynamic-reconfigure libdiagnostic-aggregator-tools libdiagnostic-aggregator-dev ros-robot-state-publisher
  python3-numpy python3-matplotlib python3-pil python3-scipy python3-tqdm python3-yaml python3-setuptools python3-pytest
)

# The value of a key of os-release, without its quotes.
os_release() { sed -n "s/^$1=\"\{0,1\}\([^\"]*\)\"\{0,1\}$/\1/p" "$system/etc/os-release" 2>/dev/null || true; }

is_installed() { dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null | grep -qx installed; }

# Prints those of its arguments that are not installed.
missing_of() {
  for package in "$@"; do is_installed "$package" || echo "$package"; done
}

# The distribution of the sourced ROS, else of one that is installed, ROS 1 first, else of the one that this system could have.
ros_distribution() {
  local installed first
  installed=$(find "$system/opt/ros" -mindepth 1 -maxdepth 1 -printf '%f\n' 2>/dev/null || true)
  first=$(grep -m 1 -xE "$ros_1" <<<"$installed" || head -n 1 <<<"$installed")
  case "$(os_release VERSION_ID)" in
    22.04 | 24.04) echo "${ROS_DISTRO:-${first:-one}}" ;;
    *) echo "${ROS_DISTRO:-${first:-noetic}}" ;;
  esac
}

# For systems that are not ours to change.
check_with_rosdep() {
  local distribution reason
  distribution=$(ros_distribution)
  if ! grep -qxE "$ros_1" <<<"$distribution"; then
    echo "install_dependencies.sh: nothing was installed: rio_t needs ROS 1, and the packages of ROS 1 may remove the ROS 2" \
      "($distribution) of this machine. docker/one.Dockerfile has ROS One, which is ROS 1 for Ubuntu 22.04 and 24.04." >&2
    exit 3
  fi
  if [ -n "${ROS_DISTRO:-}" ] && command -v rosdep >/dev/null &&
    rosdep check --rosdistro "$distribution" --from-paths "$repository" --ignore-src >/dev/null 2>&1; then
    mapfile -t missing < <(missing_of "$@")
    [ ${#missing[@]} -gt 0 ] || exit 0
    echo "install_dependencies.sh: missing: ${missing[*]}. Install them with the package manager of this system." >&2
    exit 3
  fi
  if [ -d "$system/opt/ros" ]; then
    reason="there is a ROS in /opt/ros, and Debian's packages of ROS may remove it"
  else
    reason="this is not Debian 11, 12 or 13 or Ubuntu 22.04 but $(os_release PRETTY_NAME)"
  fi
  cat >&2 <<END
install_dependencies.sh: nothing was installed: $reason.
Put this folder into the src/ of a catkin workspace, and type there:
  source /opt/ros/$distribution/setup.bash
  rosdep update --include-eol-distros
  rosdep install --from-paths src --ignore-src --rosdistro $distribution
  catkin_make -DCMAKE_BUILD_TYPE=Release        # or: catkin build
With the dependencies installed and ROS sourced, the scripts of rio_t run here, too.
END
  [ $# -eq 0 ] || echo "This script also needs: $*" >&2
  exit 3
}

case "$(os_release ID)-$(os_release VERSION_ID)" in
  debian-11) ;;
  debian-12 | debian-13 | ubuntu-22.04) packages+=(python3-ament-package) ;;  # catkin's setup.bash reads it; Debian 11 has none
  *) check_with_rosdep "$@" ;;
esac
if [ -d "$system/opt/ros" ]; then check_with_rosdep "$@"; fi

mapfile -t missing < <(missing_of "${packages[@]}" "$@")
[ ${#missing[@]} -gt 0 ] || exit 0

as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)
echo "rio_t needs ${#missing[@]} packages of $(os_release PRETTY_NAME) that are not installed:"
echo "  ${missing[*]}"
echo "apt-get installs them${as_root[0]:+, with sudo}."
if [ -n "${as_root[*]}" ] && [ -t 0 ]; then
  read -r -p "Go on? [y/N] " answer
  case "$answer" in y | Y | yes) ;; *) echo "install_dependencies.sh: nothing was installed" >&2; exit 1 ;; esac
fi
log=$(mktemp)
# A fresh machine may still install its updates: apt-get then waits for them [s], but not for their lock on its lists.
update() {
  local deadline=$((SECONDS + 600))
  until "${as_root[@]}" apt-get update >"$log" 2>&1; do
    grep -q /var/lib/apt/lists/lock "$log" && [ $SECONDS -lt $deadline ] || return 1
    sleep 1
  done
}
if ! { update && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
       apt-get -o DPkg::Lock::Timeout=600 install -y --no-install-recommends "${missing[@]}" >>"$log" 2>&1; }; then
  tail -n 20 "$log" >&2
  echo "install_dependencies.sh: apt-get failed, whole log in $log" >&2
  exit 1
fi
rm -f "$log"
