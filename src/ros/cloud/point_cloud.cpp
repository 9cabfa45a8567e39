#include "rio_t/ros/cloud/point_cloud.h"

#include <pcl_conversions/pcl_conversions.h>
#include <sensor_msgs/point_field_conversion.h>

#include <algorithm>
#include <array>
#include <boost/algorithm/string/join.hpp>
#include <boost/endian/conversion.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>

#include "rio_t/radar/point_filter.h"

namespace rio_t {
namespace {

using boost::algorithm::join;
using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

/// [bytes] by datatype. PointField counts its datatypes from 1.
constexpr std::array<std::size_t, 9> kSizes = {0, 1, 1, 2, 2, 4, 4, 4, 8};
static_assert(PointField::INT8 == 1 && PointField::FLOAT64 == 8);

std::string fieldsText(const PointCloud2& message) {
  return message.fields.empty() ? "none" : join(fieldNames(message), ", ");
}

bool hasField(const PointCloud2& message, const std::string& name) {
  return pcl::getFieldIndex(message, name) >= 0;
}

[[noreturn]] void throwMissing(const PointCloud2& message, const PointCloudFormat& format,
                               const std::string& missing) {
  const std::vector<std::string> fitting = fittingPresets(message);
  std::string text = "point cloud: format '" + format.name + "' needs the field '" + missing +
                     "'; fields received: " + fieldsText(message) +
                     "; presets known: " + join(pointCloudPresets(), ", ");
  const bool is_old_ti = message.fields.size() == 4 && hasField(message, "x") && hasField(message, "y") &&
                         hasField(message, "z") && hasField(message, "intensity");
  if (fitting.size() == 1) {
    text += "; the preset '" + fitting.front() + "' fits";
  } else if (fitting.size() > 1) {
    text += "; more than one preset fits: " + join(fitting, ", ") + " (choose your driver's)";
  } else if (is_old_ti) {
    text +=
        "; this is the cloud of the older radar-lab ti_mmwave driver, which has no Doppler: it gives no "
        "velocity; use ti_mmwave_rospkg 3.3 or later";
  } else {
    text += "; none fits: set the names of the fields one by one";
  }
  throw std::runtime_error(text);
}

[[noreturn]] void throwLayout(const PointCloud2& message, const std::string& fault) {
  throw std::runtime_error(
      "point cloud: " + fault + " (width " + std::to_string(message.width) + ", height " +
      std::to_string(message.height) + ", point_step " + std::to_string(message.point_step) + ", row_step " +
      std::to_string(message.row_step) + ", data " + std::to_string(message.data.size()) +
      " bytes; fields received: " + fieldsText(message) + ")");
}

constexpr bool kHostIsBigEndian = boost::endian::order::native == boost::endian::order::big;

/// Reads one field of a point, in either byte order. The constructor checks that the field lies within a
/// point, so read() needs no checks.
class FieldReader {
 public:
  FieldReader(const PointCloud2& message, const PointCloudFormat& format, const std::string& name) {
    const auto same_name = [&](const PointField& f) { return f.name == name; };
    const auto field = std::find_if(message.fields.begin(), message.fields.end(), same_name);
    if (field == message.fields.end()) throwMissing(message, format, name);
    if (std::count_if(message.fields.begin(), message.fields.end(), same_name) > 1) {
      throwLayout(message, "field '" + name + "' is there twice");
    }
    size_ = field->datatype < kSizes.size() ? kSizes[field->datatype] : 0;
    if (size_ == 0) {
      throwLayout(message,
                  "field '" + name + "' has the unknown datatype " + std::to_string(field->datatype));
    }
    // Some drivers leave count at 0 for a single value.
    if (field->count > 1) {
      throwLayout(message,
                  "field '" + name + "' holds " + std::to_string(field->count) + " values, expected one");
    }
    swaps_bytes_ = (message.is_bigendian != 0) != kHostIsBigEndian;
    offset_ = field->offset;
    datatype_ = field->datatype;
    if (static_cast<std::uint64_t>(offset_) + size_ > message.point_step) {
      throwLayout(message, "field '" + name + "' at offset " + std::to_string(offset_) + " with " +
                               std::to_string(size_) + " bytes does not fit into a point");
    }
  }

  double read(const std::uint8_t* point) const {
    alignas(double) std::array<std::uint8_t, sizeof(double)> bytes = {};  // fields need not be aligned
    const std::uint8_t* const field = point + offset_;
    if (swaps_bytes_) {
      std::reverse_copy(field, field + size_, bytes.begin());
    } else {
      std::copy_n(field, size_, bytes.begin());
    }
    return sensor_msgs::readPointCloud2BufferValue<double>(bytes.data(), datatype_);
  }

 private:
  bool swaps_bytes_ = false;
  std::size_t offset_ = 0, size_ = 0;
  std::uint8_t datatype_ = 0;
};

/// Where the points lie. The numbers are checked against the size of the data.
struct Layout {
  std::size_t width = 0, height = 0, point_step = 0, row_step = 0;
};

Layout checkedLayout(const PointCloud2& message, const PointCloudFormat& format) {
  if (message.point_step == 0) throwLayout(message, "point_step is zero");
  Layout layout;
  layout.point_step = message.point_step;
  const std::uint64_t size = message.data.size();
  const bool declares_none = message.width == 0 || message.height == 0;
  if (declares_none && format.size_from_data) {
    if (size % message.point_step != 0) throwLayout(message, "the data is not a whole number of points");
    layout.width = message.data.size() / message.point_step;
    layout.height = 1;
    return layout;
  }
  if (declares_none) {
    if (size != 0)
      throwLayout(
          message,
          "there is data, but width or height is zero; radar_cloud_size: from_data finds the number of "
          "points by the length of the data");
    return layout;
  }
  // Products of two 32-bit numbers fit into 64 bits; those of three need not, so divide instead.
  const std::uint64_t row = std::uint64_t{message.width} * message.point_step;
  if (row > size) throwLayout(message, "the data is shorter than one row of points");
  // With one row, row_step means nothing, and drivers often leave it unset.
  const std::uint64_t step = message.height > 1 ? std::uint64_t{message.row_step} : row;
  if (step < row) throwLayout(message, "row_step is shorter than a row of points");
  if (message.height - 1 > (size - row) / step)
    throwLayout(message, "the data is shorter than the points declared");
  layout.width = message.width;
  layout.height = message.height;
  layout.row_step = static_cast<std::size_t>(step);
  return layout;
}

std::array<double, 3> fromSpherical(double azimuth, double elevation, double range, PointAxes axes) {
  const double forward = range * std::cos(elevation) * std::cos(azimuth);
  const double lateral = range * std::cos(elevation) * std::sin(azimuth);
  const double up = range * std::sin(elevation);
  return axes == PointAxes::kForwardLeftUp ? std::array<double, 3>{forward, lateral, up}
                                           : std::array<double, 3>{lateral, forward, up};
}

bool isFinite(const RadarPointPcl& p) {
  // After the narrowing to float: a double of 1e300 would else pass.
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(p.doppler) &&
         std::isfinite(p.snr_db);
}

float narrow(double value) {
  // A conversion that overflows is undefined; the decoder drops a point with NaN.
  if (!(std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max()))) {
    return std::numeric_limits<float>::quiet_NaN();
  }
  return static_cast<float>(value);
}

/// Whether a driver only fills its cloud up with this point.
bool isPadding(const std::array<double, 3>& p) {
  const auto all = [&p](auto is) { return std::all_of(p.begin(), p.end(), is); };
  return all([](double x) { return narrow(x) == 0.0F; }) || all([](double x) { return std::isnan(x); });
}

}  // namespace

double toDecibel(double power, PowerUnit unit) {
  switch (unit) {
    case PowerUnit::kSnrDb:
      return power;
    case PowerUnit::kSnrDeciDb:
      return 0.1 * power;
    case PowerUnit::kSnrLinear:
      // A power of zero is a very weak point, not a broken one.
      return 10.0 * std::log10(std::max(power, 1e-30));
    case PowerUnit::kNotSnr:
      break;
  }
  return static_cast<double>(kUnknownSnrDb);
}

std::vector<std::string> fieldNames(const PointCloud2& message) {
  std::vector<std::string> names;
  for (const PointField& field : message.fields) names.push_back(field.name);
  return names;
}

std::vector<std::string> fittingPresets(const PointCloud2& message) {
  std::vector<std::string> fitting;
  for (const std::string& name : pointCloudPresets()) {
    const PointCloudFormat f = pointCloudPreset(name);
    const bool cartesian = f.coordinates == PointCoordinates::kCartesian;
    const std::vector<std::string> names = {cartesian ? f.x : f.azimuth, cartesian ? f.y : f.elevation,
                                            cartesian ? f.z : f.range, f.doppler, f.power};
    if (std::all_of(names.begin(), names.end(), [&](const std::string& n) { return hasField(message, n); }))
      fitting.push_back(name);
  }
  return fitting;
}

DecodedScan decode(const PointCloud2& message, const PointCloudFormat& format) {
  if (format.doppler_sign != 1 && format.doppler_sign != -1) {
    throw std::invalid_argument("point cloud: doppler_sign must be 1 or -1, not " +
                                std::to_string(format.doppler_sign));
  }
  // If nothing was detected, some drivers leave out the fields, and some the size of a point.
  DecodedScan scan;
  if (message.data.empty() && (message.width == 0 || message.height == 0)) return scan;

  const bool cartesian = format.coordinates == PointCoordinates::kCartesian;
  const FieldReader first(message, format, cartesian ? format.x : format.azimuth);
  const FieldReader second(message, format, cartesian ? format.y : format.elevation);
  const FieldReader third(message, format, cartesian ? format.z : format.range);
  const FieldReader doppler(message, format, format.doppler);
  const bool reads_power = format.power_unit != PowerUnit::kNotSnr;
  const std::optional<FieldReader> power =
      reads_power ? std::make_optional<FieldReader>(message, format, format.power) : std::nullopt;
  const Layout layout = checkedLayout(message, format);

  scan.cloud.reserve(layout.width * layout.height);  // held by the data, so not larger than it
  for (std::size_t row = 0; row < layout.height; ++row) {
    for (std::size_t column = 0; column < layout.width; ++column) {
      const std::uint8_t* point = message.data.data() + row * layout.row_step + column * layout.point_step;
      std::array<double, 3> p = {first.read(point), second.read(point), third.read(point)};
      if (!cartesian) p = fromSpherical(p[0], p[1], p[2], format.axes);
      if (isPadding(p)) {
        ++scan.padding;
        continue;
      }
      if (format.axes == PointAxes::kForwardLeftUp) p = {-p[1], p[0], p[2]};
      RadarPointPcl decoded;
      decoded.x = narrow(p[0]);
      decoded.y = narrow(p[1]);
      decoded.z = narrow(p[2]);
      decoded.doppler = narrow(format.doppler_sign * doppler.read(point));
      const double raw_power = power ? power->read(point) : 0.0;
      decoded.snr_db = std::isfinite(raw_power) ? narrow(toDecibel(raw_power, format.power_unit))
                                                : std::numeric_limits<float>::quiet_NaN();
      if (isFinite(decoded)) {
        scan.cloud.push_back(decoded);
      } else {
        ++scan.dropped_not_finite;
      }
    }
  }
  return scan;
}

RadarScan toRadarScan(const pcl::PointCloud<RadarPointPcl>& cloud, Time stamp) {
  RadarScan scan;
  scan.stamp = stamp;
  scan.points.reserve(cloud.size());
  for (const RadarPointPcl& p : cloud) {
    scan.points.push_back({{p.x, p.y, p.z}, static_cast<double>(p.doppler), static_cast<double>(p.snr_db)});
  }
  markAmbiguous(scan.points);
  return scan;
}

PointCloud2 toPointCloud2(const RadarScan& scan, const std::vector<std::size_t>& indices) {
  pcl::PointCloud<RadarPointPcl> cloud;
  cloud.reserve(indices.size());
  for (const std::size_t index : indices) {
    const RadarPoint& p = scan.points.at(index);
    RadarPointPcl point;
    // From right, forward, up to forward, left, up.
    point.x = static_cast<float>(p.position_R.y());
    point.y = static_cast<float>(-p.position_R.x());
    point.z = static_cast<float>(p.position_R.z());
    point.doppler = static_cast<float>(p.doppler);
    point.snr_db = static_cast<float>(p.snr_db);
    cloud.push_back(point);
  }
  PointCloud2 message;
  pcl::toROSMsg(cloud, message);
  return message;
}

}  // namespace rio_t
