#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace rio_t {

enum class PointAxes {
  kRightForwardUp,  ///< "rfu": x right, y forward, z up, as RIO and this package
  kForwardLeftUp,   ///< "flu": x forward, y left, z up, as REP-103 and most drivers
};

/// What the position of a point is made of.
enum class PointCoordinates {
  kCartesian,  ///< "cartesian": x, y, z [m]
  /// "spherical": azimuth, elevation [rad], range [m]. Azimuth is measured from the forward axis towards the
  /// lateral axis of `axes` (rfu: positive right, flu: positive left), elevation positive up.
  kSpherical,
};

enum class PowerUnit {
  kSnrDb,      ///< "snr_db": signal to noise [dB]
  kSnrDeciDb,  ///< "snr_decidb": signal to noise in steps of 0.1 dB, as TI's side info
  kSnrLinear,  ///< "snr_linear": signal to noise, plain ratio
  kNotSnr,     ///< "not_snr": RCS, a raw intensity, or nothing: not read, the SNR filter does not apply
};

std::string toString(PowerUnit unit);

/// The rotation that turns vectors with x right, y forward, z up into the axes of the cloud.
Eigen::Quaterniond cloudFromRfu(PointAxes axes);

/// How a driver lays out its cloud. The defaults are the preset "irs".
struct PointCloudFormat {
  std::string name = "irs";  ///< for messages to people
  PointCoordinates coordinates = PointCoordinates::kCartesian;
  std::string x = "x";  ///< names of fields; those of the other coordinates are not read
  std::string y = "y";
  std::string z = "z";
  std::string azimuth = "azimuth";
  std::string elevation = "elevation";
  std::string range = "range";
  std::string doppler = "v_doppler_mps";
  std::string power = "snr_db";  ///< not read where power_unit is kNotSnr
  PointAxes axes = PointAxes::kRightForwardUp;
  int doppler_sign = 1;  ///< +1: the field is positive for receding targets; -1: for approaching ones
  PowerUnit power_unit = PowerUnit::kSnrDb;
  /// The driver leaves width and height at zero: the number of points is data.size() / point_step.
  bool size_from_data = false;
};

/// Names of the presets, in the order in which they are listed to people.
std::vector<std::string> pointCloudPresets();
/// The preset of that name. Throws std::invalid_argument, listing the presets, for an unknown one.
PointCloudFormat pointCloudPreset(const std::string& name);

}  // namespace rio_t
