#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {

/// One key, bound to a member of one Config.
struct Parameter {
  ParameterDescription description;
  /// Sets the member. Returns false and changes nothing if the value is not as expected.
  std::function<bool(const ParameterValue&)> set;
  std::function<ParameterValue()> get;
};

/// An interval. Its ends belong to it unless they are open.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_open = false;
  bool max_open = false;
  bool or_zero = false;  ///< zero is in it, too

  bool contains(double x) const;  ///< false for NaN and the infinities
  std::string text() const;       ///< " above 0 and at most 1", empty for all numbers
};

/// Collects parameters; one method for each kind of value. The members must outlive the list.
///
/// `text` is for people, in full sentences: what the parameter is, which values are typical, and when to
/// change it. config/estimator.yaml, docs/parameters.md and dynamic_reconfigure show it.
class ParameterList {
 public:
  /// Starts a section. Its parameters hold for all radars until `ofRadar` is called.
  void group(const std::string& title) {
    group_ = title;
    of_radar_ = false;
  }
  /// Says whether each radar may have its own values of the next parameters.
  void ofRadar(bool of_radar) { of_radar_ = of_radar; }
  /// Makes the next parameter one of those that a new user reads first.
  ParameterList& first() {
    is_first_ = true;
    return *this;
  }

  void number(const std::string& key, const std::string& unit, Range range, double& member,
              const std::string& text);
  template <typename Integer>
  void integer(const std::string& key, Range range, Integer& member, const std::string& text);
  void boolean(const std::string& key, bool& member, const std::string& text);
  /// Three numbers, each in the range.
  void vector3(const std::string& key, const std::string& unit, Range range, Eigen::Vector3d& member,
               const std::string& text);
  /// The same, or [] for none.
  void vector3OrEmpty(const std::string& key, const std::string& unit, Range range,
                      std::optional<Eigen::Vector3d>& member, const std::string& text);
  /// Unit quaternion x, y, z, w; normalised.
  void rotation(const std::string& key, Eigen::Quaterniond& member, const std::string& text);
  void text(const std::string& key, std::string& member, const std::string& text);
  void textOrEmpty(const std::string& key, std::string& member, const std::string& text);
  /// A text that is kept without a leading slash.
  void frame(const std::string& key, std::string& member, const std::string& text);
  /// One of several words, each standing for a value.
  template <typename T>
  void choice(const std::string& key, const std::vector<std::pair<std::string, T>>& choices, T& member,
              const std::string& text);
  /// The names of radars. It sets only their names.
  void radarNames(const std::string& key, std::vector<Config>& member, const std::string& text);

  const std::vector<Parameter>& all() const { return all_; }
  const Parameter* find(const std::string& key) const;  ///< null for a key that does not exist

 private:
  void addText(const std::string& key, std::string& member, const std::string& text, bool may_be_empty,
               bool is_frame = false);
  /// Adds a parameter. `read` converts a value for `member`, or returns nothing for a wrong one. `about`
  /// needs no group, `of_radar` and `first`.
  template <typename T, typename Read, typename Show>
  void bind(ParameterDescription about, T& member, const Read& read, const Show& show) {
    about.group = group_;
    about.of_radar = of_radar_;
    about.first = std::exchange(is_first_, false);
    const auto set = [&member, read](const ParameterValue& value) {
      std::optional<T> x = read(value);
      if (x) member = std::move(*x);
      return x.has_value();
    };
    all_.push_back({std::move(about), set, [&member, show] { return show(member); }});
  }
  /// The same for a member that a ParameterValue can hold.
  template <typename T, typename Read>
  void bind(ParameterDescription about, T& member, const Read& read) {
    bind(std::move(about), member, read, [](const T& value) { return ParameterValue{value}; });
  }

  std::string group_;
  bool of_radar_ = false;
  bool is_first_ = false;
  std::vector<Parameter> all_;
};

/// Shortest text that reads back as the same number; with a point, so that every YAML reader sees a number.
std::string numberText(double value);

/// The number that the value stands for, or nothing.
std::optional<double> asNumber(const ParameterValue& value);

template <typename Integer>
void ParameterList::integer(const std::string& key, Range range, Integer& member, const std::string& text) {
  range.max = std::min<double>(range.max, std::numeric_limits<int>::max());  // the member may have 32 bits
  bind(
      {key, "integer", "", "a whole number" + range.text(), text, range.min, range.max}, member,
      [range](const ParameterValue& value) -> std::optional<Integer> {
        // YAML and the parameter server may hold 2000.0 for 2000.
        const std::optional<double> x = asNumber(value);
        if (!x || !range.contains(*x) || std::trunc(*x) != *x) return std::nullopt;
        return static_cast<Integer>(*x);
      },
      [](Integer value) { return ParameterValue{static_cast<std::int64_t>(value)}; });
}

template <typename T>
void ParameterList::choice(const std::string& key, const std::vector<std::pair<std::string, T>>& choices,
                           T& member, const std::string& text) {
  ParameterDescription about = {key, "choice", "", "one of ", text};
  for (const auto& [word, meant] : choices) {
    about.expected += (&word == &choices.front().first ? "" : ", ") + (word.empty() ? "\"\"" : word);
  }
  bind(
      std::move(about), member,
      [choices](const ParameterValue& value) -> std::optional<T> {
        const std::string* given = std::get_if<std::string>(&value.data);
        for (const auto& [word, meant] : choices)
          if (given != nullptr && word == *given) return std::optional<T>(std::in_place, meant);
        return std::nullopt;
      },
      [choices](const T& value) {
        for (const auto& [word, meant] : choices)
          if (meant == value) return ParameterValue{word};
        return ParameterValue{std::string()};
      });
}

/// The registry: every key of `config`, once.
ParameterList parametersOf(Config& config);

struct Section {
  std::string origin;  ///< of its first entry
  ParameterEntries entries;
};

constexpr const char* kEffective = "effective";  ///< the node writes the parameters of the run under this key
/// Whether this key of the node's namespace is no parameter of the registry. No radar may have such a name.
bool isReserved(const std::string& key);

/// The entries of the top level, and those of each section: nested keys, or `name/key`.
struct SortedEntries {
  ParameterEntries top_level;
  std::map<std::string, Section> sections;  ///< by name
};
SortedEntries sortedEntries(const ParameterEntries& entries, const ParameterList& list);

/// The configuration of a radar before its section is read: that of the top level, with a radar_frame of its
/// own.
Config withoutSection(const Config& top_level, const std::string& name);

/// Returns one line for each contradiction between values that are valid one by one.
std::vector<std::string> contradictions(const Config& config);

}  // namespace rio_t
