#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "rio_t/radar/extrinsics.h"
#include "rio_t/simulation/motion.h"

namespace rio_t::simulation {

/// t_O over time: a scan stamped s was measured at s - t_O(s). Positive: the stamp is late.
struct TimeOffsetProfile {
  struct Step {
    double time;    ///< [s] from the start of the bag; holds for stamps from here on
    double change;  ///< [s]
  };

  double constant = 0.0;  ///< [s]
  double drift = 0.0;     ///< [s/s], counted from the start of the bag
  std::vector<Step> steps;

  /// Offset [s] of a scan stamped `stamp` seconds after the start.
  double at(double stamp) const {
    double offset = constant + drift * stamp;
    for (const Step& step : steps) {
      if (stamp >= step.time) offset += step.change;
    }
    return offset;
  }
};

struct RadarModelOptions {
  double rate = 10.0;           ///< [Hz] of triggers
  double first_trigger = 0.05;  ///< [s] from the start of the bag: radars of one rate need not be in phase
  /// [s] The Doppler is the mean over this time, centred at the measurement; 0 = an instant.
  double frame_length = 0.0;
  double latency = 0.06;       ///< [s] from stamp to arrival (record time)
  double latency_sigma = 0.0;  ///< [s] scatter of the latency; no scan arrives before its stamp

  double points_mean = 43.0;    ///< points a scan
  double points_sigma = 8.0;    ///< their scatter
  int points_min = 1;           ///< fewest wanted; a scan has fewer if fewer things are in view
  int points_max = 70;          ///< the sensor's limit
  bool publish_empty = true;    ///< false: scans without points are not delivered, as by some drivers
  double min_range = 0.25;      ///< [m]
  double max_range = 12.0;      ///< [m]
  double fov_azimuth = 60.0;    ///< [deg] half angle
  double fov_elevation = 45.0;  ///< [deg] half angle
  /// false: a flat radar with one row of antennas. It sees what is within `fov_elevation`, measures range and
  /// the angle to that row, and reports all points in its plane, z = 0.
  bool measures_elevation = true;

  double range_noise = 0.03;     ///< [m] sigma
  double azimuth_noise = 2.5;    ///< [deg] sigma
  double elevation_noise = 4.5;  ///< [deg] sigma
  double doppler_noise = 0.02;   ///< [m/s] sigma, before quantisation
  double doppler_step = 0.125;   ///< [m/s] quantisation; 0 = none
  /// [m/s] whole unambiguous span, a whole number of steps: a Doppler appears within [-span / 2, span / 2),
  /// whole spans away from its true value; 0 = unlimited
  double doppler_span = 0.0;

  double ghost_share = 0.03;  ///< share of the points that are ghosts: anywhere, any Doppler
  /// Share of the points that the radar reports at a second direction, too: same range, Doppler and SNR.
  double ambiguous_share = 0.0;
  double moving_share = 0.10;  ///< share of the time in which persons walk in view
  int crowd = 1;               ///< persons at once; their points replace those of the room
  double dropout_share = 0.0;  ///< share of the scans that are triggered but lost
  struct Interval {
    double start;     ///< [s] from the start of the bag
    double duration;  ///< [s]
  };
  std::vector<Interval> blackouts;     ///< no scan with a stamp inside is delivered
  std::vector<Interval> ghost_bursts;  ///< all points of a scan with a stamp inside are ghosts

  /// Leaves exact points of static reflectors, and delivers every scan. Blackouts and bursts of ghosts stay,
  /// since the user asked for each of them. The limits of the sensor also stay: field of view, elevation,
  /// Doppler span.
  void removeErrors();
};

/// A radar on the rig: its model, the offset of its stamps, and its mounting.
struct RadarSetup {
  RadarModelOptions radar;
  TimeOffsetProfile time_offset;
  Extrinsics T_IR{Eigen::Vector3d(0.03, 0.03, -0.06),
                  Eigen::Quaterniond(0.00524, 0.69946, 0.71461, 0.00723).normalized()};  ///< of the IRS rig
};

struct SimulatedPoint {
  Eigen::Vector3d position_R =
      Eigen::Vector3d::Zero();  ///< as measured [m], RIO axes: x right, y forward, z up
  double doppler = 0.0;         ///< range rate [m/s], positive = receding
  double snr_db = 0.0;
  double noise_db = 0.0;
};

struct SimulatedScan {
  std::uint32_t seq = 0;
  Time stamp;                                     ///< trigger
  Time measured;                                  ///< stamp - t_O
  Time arrival;                                   ///< when a driver would publish it
  double time_offset = 0.0;                       ///< true t_O of this scan [s]
  bool delivered = true;                          ///< false: lost, or empty and not published
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();  ///< true velocity of the radar at `measured`, in R [m/s]
  std::vector<SimulatedPoint> points;             ///< empty if not delivered
};

/// A place on the path, and the static reflectors scattered around it, in W [m].
struct Station {
  Eigen::Vector3d p_W;
  std::vector<Eigen::Vector3d> reflectors_W;
};

/// Makes reflectors around the path of `motion`: within radar range everywhere, and enough for `points_mean`
/// points a scan.
std::vector<Station> makeScene(const Motion& motion, std::uint64_t seed, double points_mean);

/// Simulates a radar on `motion`. Leaves out scans that are measured outside the motion. Each scan draws from
/// a sequence of its own, so that a lost scan does not change the others. Throws std::invalid_argument for
/// options out of range.
std::vector<SimulatedScan> simulateRadar(const Motion& motion, const RadarSetup& setup, std::uint64_t seed,
                                         Time start);

}  // namespace rio_t::simulation
