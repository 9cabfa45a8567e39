#include "rio_t/simulation/presets.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "rio_t/core/angle.h"

namespace rio_t::simulation {
namespace {

// Rotation from the axes of a radar (x right, y forward, z up) to those of an IMU (x forward, y left, z up)
// for a radar that looks `left` to the left and `up` upwards [rad].
Eigen::Quaterniond lookingTo(double left, double up) {
  return Eigen::AngleAxisd(left, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(-up, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(-90.0 * kDegree, Eigen::Vector3d::UnitZ());
}

// A small go-kart indoors with a cheap radar: few points, coarse Doppler, an IMU on a frame that shakes.
Preset kart() {
  Preset p;
  p.name = "kart";
  p.summary =
      "go-kart in a hall, IMU that shakes, cheap radar: 30 Hz, 6 points a scan, Doppler in steps of "
      "0.49 m/s";
  p.motion = "kart";
  p.rest = {2.0, 3.0, 2.0};
  p.duration = 90.0;  // leaves 83 s of path, about 120 m

  ImuModelOptions& imu = p.options.imu;
  imu.rate = 100.0;
  imu.accel_vibration = 0.8;

  RadarModelOptions& radar = p.options.radar;
  radar.rate = 30.0;
  // 10, 50 and 90 % of the scans have at most 3, 6 and 10 points; its driver sends no empty clouds.
  radar.points_mean = 6.3;
  radar.points_sigma = 2.7;
  radar.points_min = 0;
  radar.points_max = 20;
  radar.publish_empty = false;
  radar.doppler_step = 0.49;
  // Found by trying: a spread (standard deviation) of 31 degrees in azimuth and 35 in elevation, the noise of
  // a small array included, and a median range of 2.9 m.
  radar.fov_azimuth = 54.0;
  radar.fov_elevation = 80.0;
  radar.max_range = 4.8;
  radar.azimuth_noise = 3.0;
  radar.elevation_noise = 8.0;
  radar.ghost_share = 0.05;
  // A person alone gives 6 points or more and would be most of the cloud.
  radar.moving_share = 0.0;

  p.options.T_IR.l_I = {1.0, 0.3, 0.0};
  p.options.T_IR.q_IR = lookingTo(30.0 * kDegree, 22.0 * kDegree);
  return p;
}

// The kart with a second radar that looks to the other side. They share no trigger, so they are out of phase.
Preset kartPair() {
  Preset p = kart();
  p.name = "kart_pair";
  p.summary = "the kart with two such radars, left and right, that look 30 degrees to either side";
  const RadarSetup& left = p.options;
  RadarSetup right = left;
  right.T_IR.l_I.y() = -left.T_IR.l_I.y();
  right.T_IR.q_IR = lookingTo(-30.0 * kDegree, 22.0 * kDegree);
  right.radar.first_trigger = left.radar.first_trigger + 0.012;  // of 0.033 s
  p.options.radars = {{"left", left}, {"right", right}};
  return p;
}

}  // namespace

std::vector<Preset> presets() { return {kart(), kartPair()}; }

Preset presetOf(const std::string& name) {
  const std::vector<Preset> known = presets();
  const auto found =
      std::find_if(known.begin(), known.end(), [&](const Preset& p) { return p.name == name; });
  if (found != known.end()) return *found;
  std::string names;
  for (const Preset& p : known) names += (names.empty() ? "" : ", ") + p.name;
  throw std::invalid_argument("preset '" + name + "' is not known; known are: " + names);
}

}  // namespace rio_t::simulation
