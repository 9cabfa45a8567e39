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

/// Whether the norm of `q` is within 1 % of 1, as that of a rotation rounded in a file. False for NaN.
bool isUnit(const Eigen::Quaterniond& q);

/// Reads a TUM trajectory: `stamp x y z qx qy qz qw` a line, seconds and metres; `#` comments and blank lines
/// are skipped. Stamps keep their nanoseconds. Quaternions are normalised; they must be unit to 1 %. Throws
/// std::runtime_error naming the file, the line number and what was expected.
Trajectory readTum(const std::string& path);
/// The same from a stream; `name` stands for the file in messages.
Trajectory readTum(std::istream& in, const std::string& name);

/// Writes the format above, stamps with nine decimals. Throws std::runtime_error if it cannot write.
void writeTum(const std::string& path, const Trajectory& trajectory);
/// Appends one line of this format.
void appendTumLine(std::string* text, const StampedPose& pose);

/// Exact time of a decimal text such as `1700000010.012222` or `1.700000010012222e+09`, rounded to the
/// nearest nanosecond. Never goes through double. Throws std::invalid_argument if the text is no such number.
Time parseTime(const std::string& text);
/// The inverse of parseTime: seconds with nine decimals, exact.
std::string formatTime(Time time);
/// The finite number in the text; none if the whole text is not one.
std::optional<double> finiteNumber(const std::string& text);

/// Largest difference of the stamps of two matched poses [s]. This is evo's default, so that figures agree
/// with evo's. The nearest pose is matched anyway, so the limit matters only in gaps and at the ends.
constexpr double kDefaultMaxDifference = 0.01;

/// Indices of two poses with (about) the same time in their trajectories.
struct Match {
  std::size_t truth = 0;
  std::size_t estimate = 0;
};

/// Matches by nearest stamp, at most `max_difference` [s] away, as evo's `associate_trajectories`, including
/// its rounding to double. A pose may be matched twice.
std::vector<Match> associate(const Trajectory& truth, const Trajectory& estimate,
                             double max_difference = kDefaultMaxDifference);

}  // namespace rio_t
