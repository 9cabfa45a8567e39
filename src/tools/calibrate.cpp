// Finds time offset and mounting of radars from bags. See `calibrate --help`.
#include <iostream>
#include <string>
#include <vector>

#include "rio_t/ros/bag/calibration.h"

int main(int argc, char** argv) {
  return rio_t::runCalibrationTool(std::vector<std::string>(argv + 1, argv + argc), std::cout, std::cerr);
}
