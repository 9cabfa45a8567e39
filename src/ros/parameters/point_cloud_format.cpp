#include "rio_t/ros/parameters/point_cloud_format.h"

#include <array>
#include <boost/algorithm/string/join.hpp>
#include <stdexcept>
#include <utility>

#include "rio_t/radar/mounting.h"

namespace rio_t {
namespace {

template <typename Choice, std::size_t N>
using Names = std::array<std::pair<Choice, const char*>, N>;

constexpr Names<PointAxes, 2> kAxes = {
    {{PointAxes::kRightForwardUp, "rfu"}, {PointAxes::kForwardLeftUp, "flu"}}};
constexpr Names<PointCoordinates, 2> kCoordinates = {
    {{PointCoordinates::kCartesian, "cartesian"}, {PointCoordinates::kSpherical, "spherical"}}};
constexpr Names<PowerUnit, 4> kPowerUnits = {{{PowerUnit::kSnrDb, "snr_db"},
                                              {PowerUnit::kSnrDeciDb, "snr_decidb"},
                                              {PowerUnit::kSnrLinear, "snr_linear"},
                                              {PowerUnit::kNotSnr, "not_snr"}}};

template <typename Choice, std::size_t N>
std::string nameOf(Choice choice, const Names<Choice, N>& names) {
  for (const auto& [value, name] : names) {
    if (value == choice) return name;
  }
  throw std::invalid_argument("point cloud: a choice without a name");
}

template <typename Choice, std::size_t N>
Choice choiceOf(const std::string& name, const char* what, const Names<Choice, N>& names) {
  std::string known;
  for (const auto& [value, value_name] : names) {
    if (name == value_name) return value;
    known += known.empty() ? value_name : std::string(", ") + value_name;
  }
  throw std::invalid_argument(std::string("point cloud: ") + what + " must be one of " + known + ", not '" +
                              name + "'");
}

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

/// The presets with the fields of each source; see docs and the sources' own message definitions.
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

std::string toString(PointAxes axes) { return nameOf(axes, kAxes); }
std::string toString(PointCoordinates coordinates) { return nameOf(coordinates, kCoordinates); }
std::string toString(PowerUnit unit) { return nameOf(unit, kPowerUnits); }
PointAxes pointAxesFromString(const std::string& name) { return choiceOf(name, "axes", kAxes); }
PointCoordinates pointCoordinatesFromString(const std::string& name) {
  return choiceOf(name, "coordinates", kCoordinates);
}
PowerUnit powerUnitFromString(const std::string& name) { return choiceOf(name, "power_unit", kPowerUnits); }

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
