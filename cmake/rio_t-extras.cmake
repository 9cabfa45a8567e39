# For packages that use rio_t. Ceres comes as its own CMake target: catkin would export the file of its library alone,
# which may be a static one that needs glog and SuiteSparse.
find_package(Ceres REQUIRED)
list(APPEND rio_t_INCLUDE_DIRS ${CERES_INCLUDE_DIRS})
list(APPEND rio_t_LIBRARIES ${CERES_LIBRARIES})
