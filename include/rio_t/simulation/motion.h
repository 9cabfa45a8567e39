#pragma once

#include "rio_t/simulation/trajectory_spline.h"

namespace rio_t::simulation {

/// Rest before and after a motion. Zero means none: the motion then starts (or ends) at its full speed.
struct MotionRestOptions {
  double static_start = 12.0;  ///< [s]
  double static_end = 3.0;     ///< [s]
  double ramp = 2.0;           ///< [s] from rest to full speed and back
};

/// A motion along a spline with rest at both ends.
///
/// The motion follows the path of the spline, but at another pace: the path time s(t) stands still, speeds up
/// to ds/dt = 1 and slows down again. ds/dt has three continuous derivatives, so the motion stays as smooth
/// as the spline, and rest is exact.
class Motion {
 public:
  /// Throws std::invalid_argument for negative times, or for a spline that is too short for the ramps.
  Motion(TrajectorySpline path, const MotionRestOptions& rest);

  /// Seconds from the first moment of rest to the last.
  double duration() const { return duration_; }
  /// At `t` seconds after the start, 0 <= t <= duration(). Throws std::out_of_range outside.
  MotionState at(double t) const;

  const TrajectorySpline& path() const { return path_; }
  const MotionRestOptions& rest() const { return rest_; }

  /// Duration of the spline of a motion that lasts `duration` seconds.
  static double pathDuration(double duration, const MotionRestOptions& rest);

 private:
  struct PathTime {
    double s;    // [s] along the spline
    double ds;   // ds/dt
    double dds;  // d2s/dt2 [1/s]
  };
  PathTime pathTime(double t) const;

  // All read-only after construction.
  TrajectorySpline path_;
  MotionRestOptions rest_;
  double duration_;
};

}  // namespace rio_t::simulation
