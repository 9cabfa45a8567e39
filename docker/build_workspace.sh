#!/usr/bin/env bash
# Builds the catkin workspace in $1 with catkin_make and runs its tests, in a shell with ROS sourced.
# RIO_T_WERROR=ON: warnings are errors.
set -euo pipefail
cd "${1:?expected the folder of the workspace}"
catkin_make -DCMAKE_BUILD_TYPE=Release -DRIO_T_WERROR="${RIO_T_WERROR:-OFF}"
catkin_make run_tests
catkin_test_results build
