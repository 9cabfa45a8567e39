// What a driver, or anybody on the network, may send as a scan. Input: choices of the format, sizes and
// fields (libFuzzer's provider takes them from the end), then the bytes of the points. See scripts/fuzz.sh.
#include <fuzzer/FuzzedDataProvider.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>

#include "rio_t/radar/ego_velocity.h"
#include "rio_t/ros/cloud/point_cloud.h"

namespace {

using rio_t::PointCloudFormat;
using sensor_msgs::PointCloud2;

constexpr std::size_t kMaxFields = 12;
constexpr std::size_t kEstimatedPoints = 100;  // larger scans are decoded only: time

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

/// Small mostly, so that layouts come out that fit; anything at times.
std::uint32_t size(FuzzedDataProvider& input) {
  return input.ConsumeBool() ? input.ConsumeIntegral<std::uint8_t>() : input.ConsumeIntegral<std::uint32_t>();
}

PointCloudFormat anyFormat(FuzzedDataProvider& input) {
  const std::vector<std::string> presets = rio_t::pointCloudPresets();
  PointCloudFormat format =
      rio_t::pointCloudPreset(presets[input.ConsumeIntegralInRange<std::size_t>(0, presets.size() - 1)]);
  if (input.ConsumeBool()) return format;
  format.coordinates =
      input.ConsumeBool() ? rio_t::PointCoordinates::kSpherical : rio_t::PointCoordinates::kCartesian;
  format.axes = input.ConsumeBool() ? rio_t::PointAxes::kForwardLeftUp : rio_t::PointAxes::kRightForwardUp;
  format.power_unit = static_cast<rio_t::PowerUnit>(input.ConsumeIntegralInRange(0, 3));
  format.doppler_sign = input.ConsumeIntegralInRange(-1, 1);
  format.size_from_data = input.ConsumeBool();
  return format;
}

PointCloud2 anyMessage(FuzzedDataProvider& input, const PointCloudFormat& format) {
  const std::string names[] = {format.x,         format.y,     format.z,       format.azimuth,
                               format.elevation, format.range, format.doppler, format.power};
  PointCloud2 message;
  message.is_bigendian = input.ConsumeBool() ? 0 : input.ConsumeIntegral<std::uint8_t>();
  message.width = size(input);
  message.height = size(input);
  message.point_step = size(input);
  message.row_step = size(input);
  message.fields.resize(input.ConsumeIntegralInRange<std::size_t>(0, kMaxFields));
  for (sensor_msgs::PointField& field : message.fields) {
    field.name = input.ConsumeBool() ? input.PickValueInArray(names) : input.ConsumeRandomLengthString(8);
    field.offset = size(input);
    field.datatype = input.ConsumeIntegral<std::uint8_t>();
    field.count = input.ConsumeBool() ? 1 : size(input);
  }
  message.data = input.ConsumeRemainingBytes<std::uint8_t>();
  return message;
}

/// What was decoded goes out again as the inliers do, and comes back.
void requireRoundTrip(const rio_t::RadarScan& scan) {
  std::vector<std::size_t> all(scan.points.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  PointCloudFormat own;
  own.doppler = "doppler";
  own.axes = rio_t::PointAxes::kForwardLeftUp;  // of all that we publish
  const rio_t::RadarScan again = toRadarScan(decode(toPointCloud2(scan, all), own).cloud, scan.stamp);
  require(again.points.size() == scan.points.size(), "published clouds hold every point");
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    require(again.points[i].position_R == scan.points[i].position_R &&
                again.points[i].doppler == scan.points[i].doppler &&
                again.points[i].snr_db == scan.points[i].snr_db,
            "published points are those decoded");
  }
}

void requireSoundVelocity(const rio_t::RadarScan& scan) {
  static const rio_t::EgoVelocityEstimator estimator{rio_t::EgoVelocityOptions()};
  const rio_t::EgoVelocity velocity = estimator.estimate(scan);
  for (const std::size_t index : velocity.inliers)
    require(index < scan.points.size(), "inliers are points of the scan");
  if (!isValid(velocity.status)) return;
  require(velocity.v_R.allFinite() && velocity.covariance.allFinite(), "valid velocities are finite");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const PointCloudFormat format = anyFormat(input);
  const PointCloud2 message = anyMessage(input, format);
  rio_t::DecodedScan decoded;
  try {
    decoded = decode(message, format);
  } catch (const std::runtime_error&) {
    return 0;  // as documented, for clouds
  } catch (const std::invalid_argument&) {
    require(format.doppler_sign == 0, "only a wrong format is an invalid argument");
    return 0;
  }
  require(decoded.cloud.size() + decoded.dropped_not_finite <= message.data.size(),
          "no more points than bytes");
  for (const rio_t::RadarPointPcl& p : decoded.cloud) {
    require(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(p.doppler) &&
                std::isfinite(p.snr_db),
            "decoded points are finite");
  }
  const rio_t::RadarScan scan = toRadarScan(decoded.cloud, rio_t::Time());
  requireRoundTrip(scan);
  if (scan.points.size() <= kEstimatedPoints) requireSoundVelocity(scan);
  return 0;
}
