#pragma once

#include <cstddef>
#include <deque>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/pose.h"

namespace rio_t {

/// Poses of the IMU frame I in a world frame W, stamps strictly increasing. A deque: a run may have millions
/// of them, and none is copied while it grows.
using Trajectory = std::deque<StampedPose>;

/// Whether `q` may stand for a rotation: rounding in a file changes its norm by less than 1 %. False for NaN.
bool isUnit(const Eigen::Quaterniond& q);

/// Reads a TUM trajectory: `stamp x y z qx qy qz qw` a line, seconds and metres; `#` comments and blank lines
/// are skipped. Stamps keep their nanoseconds. Quaternions are normalised; they must be unit to 1 %. Throws
/// std::runtime_error naming the file, the line number and what was expected.
Trajectory readTum(const std::string& path);
/// The same from a stream; `name` stands for the file in messages.
Trajectory readTum(std::istream& in, const std::string& name);

/// Writes the format above, stamps with nine decimals. Throws std::runtime_error if it cannot write.
void writeTum(const std::string& path, const Trajectory& trajectory);
/// One line of it, for programs that write as they go.
void appendTumLine(std::string* text, const StampedPose& pose);

/// Exact time of a decimal text such as `1700000010.012222` or `1.700000010012222e+09`, rounded to the
/// nearest nanosecond. Never goes through double. Throws std::invalid_argument if the text is no such number.
Time parseTime(const std::string& text);
/// Its inverse: seconds with nine decimals, exact.
std::string formatTime(Time time);
/// The finite number that the whole text stands for; none if it is no such text.
std::optional<double> finiteNumber(const std::string& text);

/// Largest difference of the stamps of two poses that are compared, by default [s]. It is evo's default, so
/// that figures agree with evo's without options on either side; the nearest pose wins anyhow, so it only
/// matters in gaps and at the ends.
constexpr double kDefaultMaxDifference = 0.01;

/// Positions of two poses of (about) the same time in their trajectories.
struct Match {
  std::size_t truth = 0;
  std::size_t estimate = 0;
};

/// Matches by nearest stamp, at most `max_difference` [s] away, as evo's `associate_trajectories`, including
/// its rounding to double. A pose may be matched twice.
std::vector<Match> associate(const Trajectory& truth, const Trajectory& estimate,
                             double max_difference = kDefaultMaxDifference);

}  // namespace rio_t
