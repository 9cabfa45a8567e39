// Parameter files, whatever they hold: read, or refused with a std::runtime_error; what was accepted survives
// being printed and read again, and the estimator takes it. See scripts/fuzz.sh.
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/ros/parameters/parameters.h"

namespace {

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

rio_t::ParameterEntries read(const std::string& yaml) { return rio_t::readParameters(yaml, "file"); }

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    rio_t::makeConfig({rio_t::parseAssignment(text)});
  } catch (const std::invalid_argument&) {
  } catch (const rio_t::ConfigError&) {
  }

  rio_t::Config config;
  try {
    config = rio_t::makeConfig(read(text));
  } catch (const std::runtime_error&) {
    return 0;
  }
  // From here on nothing may throw.
  const std::string printed = rio_t::toYaml(config);
  require(rio_t::toYaml(rio_t::makeConfig(read(printed))) == printed, "what is printed reads back the same");
  for (const rio_t::Config& radar : rio_t::configsOfRadars(config)) rio_t::pointCloudFormat(radar);
  const rio_t::RadarInertialOdometry odometry(config.odometry);
  return 0;
}
