#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {

/// One key, bound to a member of one Config.
struct Parameter {
  ParameterDescription description;
  std::function<bool(const ParameterValue&)>
      set;                             ///< false, and nothing changed, where it is not as expected
  std::function<std::string()> print;  ///< as YAML
};

/// An interval; what lies on its ends belongs to it unless the end is open.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_open = false;
  bool max_open = false;

  bool contains(double x) const;  ///< false for NaN and the infinities
  std::string text() const;       ///< " above 0 and at most 1", empty for all numbers
};

/// Collects parameters; one method for each kind of value. The members must outlive the list.
class ParameterList {
 public:
  /// Title of the section that the next parameters stand in. They hold for all radars.
  void group(const std::string& title) {
    group_ = title;
    of_radar_ = false;
  }
  /// Whether each radar may have its own of the next parameters.
  void ofRadar(bool of_radar) { of_radar_ = of_radar; }

  void number(const std::string& key, const std::string& unit, Range range, double& member,
              const std::string& meaning);
  template <typename Integer>
  void integer(const std::string& key, Range range, Integer& member, const std::string& meaning);
  void boolean(const std::string& key, bool& member, const std::string& meaning);
  /// Three numbers, each in the range.
  void vector3(const std::string& key, const std::string& unit, Range range, Eigen::Vector3d& member,
               const std::string& meaning);
  /// Unit quaternion x, y, z, w; normalised.
  void rotation(const std::string& key, Eigen::Quaterniond& member, const std::string& meaning);
  void text(const std::string& key, std::string& member, const std::string& meaning);
  void textOrEmpty(const std::string& key, std::string& member, const std::string& meaning);
  /// One of several words, each standing for a value.
  template <typename T>
  void choice(const std::string& key, const std::vector<std::pair<std::string, T>>& choices, T& member,
              const std::string& meaning);
  /// One of several words, kept as text.
  void word(const std::string& key, const std::vector<std::string>& words, std::string& member,
            const std::string& meaning);
  /// The names of radars; sets nothing but their names.
  void radarNames(const std::string& key, std::vector<Config>& member, const std::string& meaning);

  const std::vector<Parameter>& all() const { return all_; }

 private:
  void add(const std::string& key, const std::string& unit, const std::string& expected,
           const std::string& meaning, std::function<bool(const ParameterValue&)> set,
           std::function<std::string()> print);

  /// Of the parameter added last.
  void setRange(const Range& range) {
    all_.back().description.min = range.min;
    all_.back().description.max = range.max;
  }

  std::string group_;
  bool of_radar_ = false;
  std::vector<Parameter> all_;
};

/// Shortest text that reads back as the same number; with a point, so that every YAML reader sees a number.
std::string numberText(double value);
std::string quotedText(const std::string& text);

template <typename Integer>
void ParameterList::integer(const std::string& key, Range range, Integer& member,
                            const std::string& meaning) {
  add(
      key, "", "a whole number" + range.text(), meaning,
      [range, &member](const ParameterValue& value) {
        const std::int64_t* x = std::get_if<std::int64_t>(&value.data);
        if (x == nullptr || !range.contains(static_cast<double>(*x))) return false;
        if (*x > std::numeric_limits<int>::max())
          return false;  // beyond any sense, and the member may be 32 bit
        member = static_cast<Integer>(*x);
        return true;
      },
      [&member] { return std::to_string(member); });
  setRange(range);
}

template <typename T>
void ParameterList::choice(const std::string& key, const std::vector<std::pair<std::string, T>>& choices,
                           T& member, const std::string& meaning) {
  std::string expected = "one of ";
  for (const auto& each : choices) {
    if (&each != &choices.front()) expected += ", ";
    expected += each.first.empty() ? "\"\"" : each.first;
  }
  add(
      key, "", expected, meaning,
      [choices, &member](const ParameterValue& value) {
        const std::string* text = std::get_if<std::string>(&value.data);
        for (const auto& [word, meant] : choices) {
          if (text == nullptr || word != *text) continue;
          member = meant;
          return true;
        }
        return false;
      },
      [choices, &member] {
        for (const auto& [word, meant] : choices) {
          if (meant == member) return word.empty() ? std::string("\"\"") : word;
        }
        return std::string("\"\"");
      });
}

/// The registry: every key of `config`, once.
ParameterList parametersOf(Config& config);

}  // namespace rio_t
