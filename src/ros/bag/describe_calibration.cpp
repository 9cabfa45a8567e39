#include <array>
#include <cmath>
#include <string>

#include "../text.h"
#include "rio_t/core/angle.h"
#include "rio_t/radar/mounting.h"
#include "rio_t/ros/bag/calibration.h"

namespace rio_t {
namespace {

struct AxisText {
  const char* name;
  const char* unit;
  double per;  ///< units of the table in one unit of AxisCalibration
  int decimals;
};
/// By CalibrationAxis.
constexpr std::array<AxisText, kCalibrationAxes> kAxes = {{
    {"time offset", "ms", 1e3, 2},
    {"turn about x", "deg", 1.0 / kDegree, 2},
    {"turn about y", "deg", 1.0 / kDegree, 2},
    {"turn about z", "deg", 1.0 / kDegree, 2},
    {"lever arm x", "mm", 1e3, 1},
    {"lever arm y", "mm", 1e3, 1},
    {"lever arm z", "mm", 1e3, 1},
}};

std::string padded(const std::string& text, std::size_t width, bool to_the_right) {
  const std::string blanks(text.size() < width ? width - text.size() : 0, ' ');
  return to_the_right ? blanks + text : text + blanks;
}

std::string axisRow(std::size_t axis, const AxisCalibration& values) {
  const AxisText& text = kAxes[axis];
  const auto column = [&](double value) {
    return padded(fixedText(text.per * value, text.decimals), 10, true);
  };
  std::string row = "  " + padded(text.name, 14, false) + padded(text.unit, 4, false) +
                    column(values.configured) + column(values.found) + column(values.sigma) + "   " +
                    toString(values.verdict);
  if (values.verdict == Verdict::kNotObserved)
    row += ": to observe it, " + whatToMove(static_cast<CalibrationAxis>(axis));
  return row + "\n";
}

std::string remarks(const CalibratedRadar& radar) {
  std::string text;
  for (std::size_t axis = 0; axis < kCalibrationAxes; ++axis) {
    constexpr double kFar = 3.0;
    const double far = radar.calibration.axes[axis].farFromConfigured();
    if (far < kFar) continue;
    text += std::string("  The ") + kAxes[axis].name + " differs from the given value by " +
            fixedText(far, 1) + " times its given sigma: are topic, axes, signs and units right?\n";
  }
  if (!radar.calibration.offset_agreement.agree()) {
    std::string offsets;
    for (const OffsetEstimate& offset : radar.offsets)
      appendItem(&offsets, fixedText(1e3 * offset.t_O, 2) + " ms");
    text += "  The offset differs between the bags: " + offsets +
            "; a driver's restart may change it.\n"
            "  The value found is their mean, and its sigma covers the differences.\n";
  }
  const Agreement& extrinsics = radar.calibration.extrinsics_agreement;
  if (!extrinsics.agree()) {
    text += "  The mounting differs between the bags by more than the sigmas say: chi-squared " +
            fixedText(extrinsics.chi_squared, 1) + " with " + std::to_string(extrinsics.degrees_of_freedom) +
            " degrees of freedom.\n  The sigmas are " + fixedText(extrinsics.widening(), 1) +
            " times as wide for that reason.\n";
  }
  return text;
}

/// Returns the mounting found, as mounting_yaw_pitch_roll_deg has it.
std::string mountingWords(const CalibratedRadar& radar) {
  const MountingAngles found = mountingOf(radar.calibration.T_IR.q_IR);
  const auto degrees = [](double angle) { return fixedText(1.0 / kDegree * angle, 1); };
  return "  mounting: yaw " + degrees(found.yaw) + " (left), pitch " + degrees(found.pitch) + " (up), roll " +
         degrees(found.roll) + " (right side down) deg, seen from x forward, y left, z up of the IMU\n";
}

}  // namespace

std::string describeCalibration(const CalibratedRadar& radar) {
  std::string table = "  " + padded(radar.name.empty() ? "radar" : "radar " + radar.name, 18, false) +
                      padded("given", 10, true) + padded("found", 10, true) + padded("sigma", 10, true) +
                      "\n";
  for (std::size_t axis = 0; axis < kCalibrationAxes; ++axis)
    table += axisRow(axis, radar.calibration.axes[axis]);
  return table + mountingWords(radar) + remarks(radar);
}

std::string describeCalibration(const BagCalibration& calibration) {
  std::size_t count = 0;
  std::string paths;
  for (const CalibrationBag& bag : calibration.bags) {
    if (!bag.failure.empty()) continue;
    ++count;
    appendItem(&paths, bag.path);
  }
  std::string text = std::to_string(count) + " of " + std::to_string(calibration.bags.size()) +
                     (calibration.bags.size() == 1 ? " bag counts: " : " bags count: ") + paths + "\n";
  for (const CalibratedRadar& radar : calibration.radars) text += describeCalibration(radar);
  return text + "Turns are about the axes of the IMU, from the mounting that was given.\n";
}

}  // namespace rio_t
