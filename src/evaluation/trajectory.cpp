#include "rio_t/evaluation/trajectory.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "rio_t/core/format.h"
#include "rio_t/core/replace_file.h"

namespace rio_t {
namespace {

constexpr const char* kLineFormat = "`stamp x y z qx qy qz qw` (8 numbers, separated by spaces)";

[[noreturn]] void fail(const std::string& name, std::size_t line, const std::string& what) {
  throw std::runtime_error(name + ":" + std::to_string(line) + ": " + what);
}

/// None if the line is blank or a comment.
std::optional<StampedPose> parseLine(const std::string& line) {
  std::istringstream words(line);
  std::vector<std::string> fields;
  for (std::string word; words >> word;) fields.push_back(word);
  if (fields.empty() || fields.front().front() == '#') return std::nullopt;
  if (fields.size() != 8) throw std::invalid_argument("found " + std::to_string(fields.size()) + " fields");
  StampedPose pose;
  pose.time = parseTime(fields[0]);
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::optional<double> number = finiteNumber(fields[i + 1]);
    if (!number) throw std::invalid_argument("'" + fields[i + 1] + "' is not a finite number");
    v[i] = *number;
  }
  pose.p_W = {v[0], v[1], v[2]};
  pose.q_WI = Eigen::Quaterniond(v[6], v[3], v[4], v[5]);
  if (!isUnit(pose.q_WI)) {
    throw std::invalid_argument("the quaternion has norm " + std::to_string(pose.q_WI.norm()) + ", not 1");
  }
  pose.q_WI.normalize();
  return pose;
}

bool isDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// Stamps as the doubles nearest to their decimal text, which is what evo compares.
std::vector<double> evoSeconds(const Trajectory& trajectory) {
  std::vector<double> seconds;
  seconds.reserve(trajectory.size());
  for (const StampedPose& pose : trajectory) {
    seconds.push_back(static_cast<double>(static_cast<long double>(pose.time.nanoseconds()) / 1e9L));
  }
  return seconds;
}

}  // namespace

bool isUnit(const Eigen::Quaterniond& q) { return std::abs(q.norm() - 1.0) <= 0.01; }

Time parseTime(const std::string& text) {
  const auto refuse = [&text]() -> std::invalid_argument {
    return std::invalid_argument("'" + text + "' is not a time in seconds within +-9.2e9");
  };
  const char* at = text.c_str();
  const bool negative = *at == '-';
  if (negative || *at == '+') ++at;
  std::string digits;
  while (isDigit(*at)) digits += *at++;
  long point = static_cast<long>(digits.size());  // the decimal point stands before digits[point]
  if (*at == '.') ++at;
  while (isDigit(*at)) digits += *at++;
  if (digits.empty()) throw refuse();
  if (*at == 'e' || *at == 'E') {  // as numpy.savetxt and evo write
    char* end = nullptr;
    const long shift = std::strtol(at + 1, &end, 10);
    if (end == at + 1 || shift < -400 || shift > 400) throw refuse();
    point += shift;
    at = end;
  }
  if (at != text.c_str() + text.size()) throw refuse();

  // Digits before the ninth decimal make up the nanoseconds; the next one rounds.
  const long last = point + 9;
  std::int64_t ns = 0;
  for (long i = 0; i < last; ++i) {
    const int digit = i < static_cast<long>(digits.size()) ? digits[static_cast<std::size_t>(i)] - '0' : 0;
    if (ns > (std::numeric_limits<std::int64_t>::max() - 10) / 10) throw refuse();
    ns = 10 * ns + digit;
  }
  if (last >= 0 && last < static_cast<long>(digits.size()) && digits[static_cast<std::size_t>(last)] >= '5')
    ++ns;
  return Time::fromNanoseconds(negative ? -ns : ns);
}

std::optional<double> finiteNumber(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || *end != '\0' || !std::isfinite(value)) return std::nullopt;
  return value;
}

Trajectory readTum(std::istream& in, const std::string& name) {
  Trajectory trajectory;
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    std::optional<StampedPose> pose;
    try {
      pose = parseLine(line);
    } catch (const std::invalid_argument& error) {
      fail(name, number, std::string(error.what()) + "; expected " + kLineFormat);
    }
    if (!pose) continue;
    if (!trajectory.empty() && pose->time <= trajectory.back().time) {
      fail(name, number, "the stamp does not come after the one before it; expected increasing stamps");
    }
    trajectory.push_back(*pose);
  }
  if (in.bad()) throw std::runtime_error(name + ": cannot be read to the end");
  return trajectory;
}

Trajectory readTum(const std::string& path) {
  if (std::filesystem::is_directory(path))
    throw std::runtime_error(path + ": expected a trajectory file (TUM format), this is a folder");
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened; expected a trajectory file (TUM format)");
  return readTum(file, path);
}

std::string formatTime(Time time) {
  const std::int64_t ns = time.nanoseconds();
  std::string text;
  appendDecimal(&text, ns < 0, static_cast<std::uint64_t>(std::abs(ns)), 9);
  return text;
}

void appendTumLine(std::string* text, const StampedPose& pose) {
  *text += formatTime(pose.time);
  for (const double value : {pose.p_W.x(), pose.p_W.y(), pose.p_W.z(), pose.q_WI.x(), pose.q_WI.y(),
                             pose.q_WI.z(), pose.q_WI.w()}) {
    text->push_back(' ');
    appendFixed(text, value, 9);
  }
  text->push_back('\n');
}

void writeTum(const std::string& path, const Trajectory& trajectory) {
  std::string text;
  for (const StampedPose& pose : trajectory) appendTumLine(&text, pose);
  replaceFile(path, text);
}

std::vector<Match> associate(const Trajectory& truth, const Trajectory& estimate, double max_difference) {
  const bool truth_is_longer = truth.size() >= estimate.size();
  const std::vector<double> shorter = evoSeconds(truth_is_longer ? estimate : truth);
  const std::vector<double> longer = evoSeconds(truth_is_longer ? truth : estimate);

  std::vector<Match> matches;
  if (longer.empty()) return matches;
  matches.reserve(shorter.size());
  for (std::size_t i = 0; i < shorter.size(); ++i) {
    const double t = shorter[i];
    auto nearest = std::lower_bound(longer.begin(), longer.end(), t);
    if (nearest == longer.end() ||
        (nearest != longer.begin() && std::abs(*(nearest - 1) - t) <= std::abs(*nearest - t))) {
      nearest = std::lower_bound(longer.begin(), nearest, *(nearest - 1));  // the first of equal doubles
    }
    if (std::abs(*nearest - t) > max_difference) continue;
    const auto j = static_cast<std::size_t>(nearest - longer.begin());
    matches.push_back(truth_is_longer ? Match{j, i} : Match{i, j});
  }
  return matches;
}

}  // namespace rio_t
