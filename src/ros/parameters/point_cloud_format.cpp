#include "rio_t/ros/parameters/point_cloud_format.h"

#include <boost/algorithm/string/join.hpp>
#include <stdexcept>

#include "rio_t/radar/mounting.h"

namespace rio_t {
namespace {

PointCloudFormat flu(const char* name, const char* doppler, const char* power, PowerUnit unit) {
  PointCloudFormat f;
  f.name = name;
  f.axes = PointAxes::kForwardLeftUp;
  f.doppler = doppler;
  f.power = power;
  f.power_unit = unit;
  return f;
}

PointCloudFormat arsSpherical() {
  PointCloudFormat f = flu("ars548_hkust", "velocity", "rcs", PowerUnit::kNotSnr);
  f.coordinates = PointCoordinates::kSpherical;
  f.size_from_data = true;  // this driver sets neither width nor height
  return f;
}

PointCloudFormat eth() {
  PointCloudFormat f;  // RIO axes
  f.name = "eth";
  f.doppler = "doppler";
  f.power = "snr";
  f.power_unit = PowerUnit::kSnrDeciDb;  // int16, TI's side info as it comes
  return f;
}

/// The presets, with the fields of each driver or data set.
const std::vector<PointCloudFormat>& presets() {
  static const std::vector<PointCloudFormat> all = {
      PointCloudFormat(),
      flu("ti_mmwave", "velocity", "intensity",
          PowerUnit::kSnrDb),  // TI's driver divides its side info by 10
      eth(),
      flu("coloradar", "doppler", "intensity", PowerUnit::kNotSnr),  // strength of the peak, not over noise
      flu("oculii", "Doppler", "Power", PowerUnit::kNotSnr),
      flu("ars548", "doppler", "intensity", PowerUnit::kNotSnr),  // RCS
      arsSpherical(),
      flu("smartmicro", "radial_speed", "snr", PowerUnit::kSnrDb),  // sign undocumented: check it
      flu("hugin", "doppler", "power", PowerUnit::kNotSnr),
  };
  return all;
}

}  // namespace

std::string toString(PowerUnit unit) {
  constexpr const char* kNames[] = {"snr_db", "snr_decidb", "snr_linear", "not_snr"};
  return kNames[static_cast<std::size_t>(unit)];
}

Eigen::Quaterniond cloudFromRfu(PointAxes axes) {
  return axes == PointAxes::kForwardLeftUp ? fluFromRfu() : Eigen::Quaterniond::Identity();
}

std::vector<std::string> pointCloudPresets() {
  std::vector<std::string> names;
  for (const PointCloudFormat& preset : presets()) names.push_back(preset.name);
  return names;
}

PointCloudFormat pointCloudPreset(const std::string& name) {
  for (const PointCloudFormat& preset : presets()) {
    if (preset.name == name) return preset;
  }
  throw std::invalid_argument("point cloud: no preset '" + name +
                              "'; presets known: " + boost::algorithm::join(pointCloudPresets(), ", "));
}

}  // namespace rio_t
