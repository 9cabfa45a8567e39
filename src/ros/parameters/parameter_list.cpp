#include "parameter_list.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "../text.h"
#include "rio_t/radar/scan.h"

namespace rio_t {
namespace {

std::string boundText(double bound) {
  std::string text = numberText(bound);
  if (text.size() > 2 && text.compare(text.size() - 2, 2, ".0") == 0) text.resize(text.size() - 2);
  return text;
}

/// `count` numbers in `range`, or nothing.
std::optional<std::vector<double>> asNumbers(const ParameterValue& value, std::size_t count,
                                             const Range& range) {
  const ParameterValue::List* list = std::get_if<ParameterValue::List>(&value.data);
  if (list == nullptr || list->size() != count) return std::nullopt;
  std::vector<double> numbers;
  for (const ParameterValue& element : *list) {
    const std::optional<double> x = asNumber(element);
    if (!x || !range.contains(*x)) return std::nullopt;
    numbers.push_back(*x);
  }
  return numbers;
}

std::optional<Eigen::Vector3d> asVector3(const ParameterValue& value, const Range& range) {
  const auto x = asNumbers(value, 3, range);
  if (!x) return std::nullopt;
  return Eigen::Vector3d(x->data());
}

/// Whether a text has no control characters. Topics, frames and file names need none, and they would break
/// the lines of messages and files.
bool isOneLine(const std::string& text) {
  return std::none_of(text.begin(), text.end(), [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; });
}

}  // namespace

std::optional<double> asNumber(const ParameterValue& value) {
  if (const double* real = std::get_if<double>(&value.data)) return *real;
  if (const std::int64_t* whole = std::get_if<std::int64_t>(&value.data)) return static_cast<double>(*whole);
  // Python's YAML reader, which fills the parameter server, takes 1e-3 for text (it wants 1.0e-3).
  if (const std::string* text = std::get_if<std::string>(&value.data)) {
    if (text->find_first_of("eE") == std::string::npos) return std::nullopt;
    const ParameterValue plain = parsePlainScalar(*text);
    if (const double* real = std::get_if<double>(&plain.data)) return *real;
  }
  return std::nullopt;
}

std::string numberText(double value) {
  std::string text;
  for (int digits = 1; digits <= 17; ++digits) {
    text = shortText(value, digits);
    // As many digits as the number needs, and at least those before the point: 60, not 6e+01.
    const bool whole_part_shown = std::abs(value) < std::pow(10.0, digits) || std::abs(value) >= 1e15;
    if (asNumber(parsePlainScalar(text)) == value && whole_part_shown) break;
  }
  if (text.find('.') == std::string::npos) {
    const std::size_t exponent = text.find('e');
    text.insert(exponent == std::string::npos ? text.size() : exponent, ".0");
  }
  return text;
}

bool Range::contains(double x) const {
  if (or_zero && x == 0.0) return true;
  return (min_open ? x > min : x >= min) && (max_open ? x < max : x <= max) && std::isfinite(x);
}

std::string Range::text() const {
  std::string text;
  if (std::isfinite(min)) text += (min_open ? " above " : " of at least ") + boundText(min);
  if (std::isfinite(max)) {
    text += (text.empty() ? "" : " and") + std::string(max_open ? " below " : " at most ") + boundText(max);
  }
  return (or_zero ? " of 0, or" : "") + text;
}

const Parameter* ParameterList::find(const std::string& key) const {
  const auto found = std::find_if(all_.begin(), all_.end(),
                                  [&](const Parameter& each) { return each.description.key == key; });
  return found == all_.end() ? nullptr : &*found;
}

void ParameterList::number(const std::string& key, const std::string& unit, Range range, double& member,
                           const std::string& text) {
  bind({key, "number", unit, "a finite number" + range.text(), text, range.or_zero ? 0.0 : range.min,
        range.max},
       member, [range](const ParameterValue& value) {
         const std::optional<double> x = asNumber(value);
         return x && range.contains(*x) ? x : std::nullopt;
       });
}

void ParameterList::boolean(const std::string& key, bool& member, const std::string& text) {
  bind({key, "boolean", "", "true or false", text}, member, [](const ParameterValue& value) {
    const bool* x = std::get_if<bool>(&value.data);
    return x == nullptr ? std::nullopt : std::optional<bool>(*x);
  });
}

void ParameterList::vector3(const std::string& key, const std::string& unit, Range range,
                            Eigen::Vector3d& member, const std::string& text) {
  const std::string each = range.text();
  bind(
      {key, "list", unit, "a list of 3 finite numbers" + (each.empty() ? "" : ", each" + each), text,
       range.min, range.max},
      member, [range](const ParameterValue& value) { return asVector3(value, range); }, listOf);
}

void ParameterList::rotation(const std::string& key, Eigen::Quaterniond& member, const std::string& text) {
  bind(
      {key, "list", "", "a list of 4 finite numbers (x, y, z, w) with a norm between 0.999 and 1.001", text},
      member,
      [](const ParameterValue& value) -> std::optional<Eigen::Quaterniond> {
        const auto x = asNumbers(value, 4, Range{});
        if (!x) return std::nullopt;
        const Eigen::Quaterniond q(x->data());  // in the order x, y, z, w
        if (std::abs(q.norm() - 1.0) > 1e-3) return std::nullopt;
        // People type fewer digits than a double has; an exact quaternion stays as it is.
        return std::abs(q.norm() - 1.0) < 1e-15 ? q : q.normalized();
      },
      [](const Eigen::Quaterniond& q) { return listOf(q.coeffs()); });
}

void ParameterList::vector3OrEmpty(const std::string& key, const std::string& unit, Range range,
                                   std::optional<Eigen::Vector3d>& member, const std::string& text) {
  using Vector = std::optional<Eigen::Vector3d>;
  bind(
      {key, "list", unit, "[], or a list of 3 finite numbers, each" + range.text(), text}, member,
      [range](const ParameterValue& value) -> std::optional<Vector> {
        const auto* list = std::get_if<ParameterValue::List>(&value.data);
        if (list != nullptr && list->empty()) return Vector();
        const Vector x = asVector3(value, range);
        return x ? std::make_optional(x) : std::nullopt;
      },
      [](const Vector& v) { return v ? listOf(*v) : ParameterValue{ParameterValue::List{}}; });
}

void ParameterList::text(const std::string& key, std::string& member, const std::string& text) {
  addText(key, member, text, false);
}

void ParameterList::textOrEmpty(const std::string& key, std::string& member, const std::string& text) {
  addText(key, member, text, true);
}

void ParameterList::frame(const std::string& key, std::string& member, const std::string& text) {
  addText(key, member, text, false, true);
}

void ParameterList::addText(const std::string& key, std::string& member, const std::string& text,
                            bool may_be_empty, bool is_frame) {
  bind({key, "text", "", std::string("one line of text, ") + (may_be_empty ? "may be" : "not") + " empty",
        text},
       member, [may_be_empty, is_frame](const ParameterValue& value) -> std::optional<std::string> {
         const bool nothing = std::holds_alternative<std::monostate>(value.data);  // `key:` and no more
         const std::string* given = std::get_if<std::string>(&value.data);
         const std::string x = given == nullptr ? "" : is_frame ? withoutSlash(*given) : *given;
         if ((given == nullptr && !nothing) || (x.empty() && !may_be_empty) || !isOneLine(x))
           return std::nullopt;
         return x;
       });
}

void ParameterList::radarNames(const std::string& key, std::vector<Config>& member, const std::string& text) {
  bind(
      {key, "list", "", "a list of at most 16 different names of lower case letters, digits and _", text},
      member,
      [](const ParameterValue& value) -> std::optional<std::vector<Config>> {
        const ParameterValue::List* list = std::get_if<ParameterValue::List>(&value.data);
        if (list == nullptr || list->size() > 16) return std::nullopt;
        std::vector<Config> radars;
        for (const ParameterValue& element : *list) {
          const std::string* name = std::get_if<std::string>(&element.data);
          if (name == nullptr || !isRadarName(*name)) return std::nullopt;
          for (const Config& other : radars)
            if (other.radar_name == *name) return std::nullopt;
          radars.emplace_back().radar_name = *name;
        }
        return radars;
      },
      [](const std::vector<Config>& radars) {
        ParameterValue::List names;
        for (const Config& radar : radars) names.emplace_back().data = radar.radar_name;
        return ParameterValue{std::move(names)};
      });
}

bool isReserved(const std::string& key) {
  static const std::set<std::string> reserved = {"config", "diagnostic_period", "diagnostic_updater",
                                                 kEffective};
  return reserved.count(key) != 0;
}

}  // namespace rio_t
