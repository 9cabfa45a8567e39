// Plays a bag through the estimator. See `rio_t_bag --help`.
#include <iostream>
#include <string>
#include <vector>

#include "rio_t/ros/bag/bag_runner.h"

int main(int argc, char** argv) {
  return rio_t::runBagTool(std::vector<std::string>(argv + 1, argv + argc), std::cout, std::cerr);
}
