#pragma once

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <iomanip>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace rio_t {

enum class Range { kAny, kNotNegative, kPositive, kShare };

inline double parseNumber(const std::string& text, Range range = Range::kAny) {
  char* end = nullptr;
  errno = 0;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || errno == ERANGE || !std::isfinite(value)) {
    throw std::invalid_argument("'" + text + "' is not a number");
  }
  if (range == Range::kNotNegative && value < 0.0) throw std::invalid_argument("'" + text + "' is below 0");
  if (range == Range::kPositive && value <= 0.0) throw std::invalid_argument("'" + text + "' is not above 0");
  if (range == Range::kShare && (value < 0.0 || value > 1.0)) {
    throw std::invalid_argument("'" + text + "' is not within 0 and 1");
  }
  return value;
}

inline std::uint64_t parseSeed(const std::string& text) {
  char* end = nullptr;
  errno = 0;
  const std::uint64_t value = std::strtoull(text.c_str(), &end, 10);
  if (text.empty() || text.find_first_not_of("0123456789") != std::string::npos || errno == ERANGE) {
    throw std::invalid_argument("'" + text + "' is not a whole number from 0");
  }
  return value;
}

inline std::vector<double> parseNumbers(const std::string& text, std::size_t count) {
  std::vector<double> values;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) values.push_back(parseNumber(part));
  if (values.size() != count) {
    throw std::invalid_argument("'" + text + "' must be " + std::to_string(count) +
                                " numbers with commas between");
  }
  return values;
}

inline std::string shown(double value) {
  std::ostringstream out;
  out << std::setprecision(10) << value;
  return out.str();
}

/// The options of a program: what each sets, and what --help says about it.
class OptionList {
 public:
  using Setter = std::function<void(const std::string&)>;
  struct Option {
    std::string name;
    std::string argument;  ///< unit or form of the value; empty for a flag
    std::string help;
    std::string shown_default;
    Setter set;  ///< empty for a heading; throws std::invalid_argument for a value that it refuses
    bool repeatable = false;  ///< each time adds; the others keep the last value
  };
  /// An option as it was given.
  struct Given {
    std::string name;
    std::string value;
  };

  void section(const std::string& heading) { options_.push_back({"", "", heading, "", nullptr}); }

  /// The reference holds until the next option is added.
  Option& add(const std::string& name, const std::string& argument, const std::string& help,
              const std::string& shown_default, const Setter& set) {
    options_.push_back({name, argument, help, shown_default, set});
    return options_.back();
  }

  void text(const std::string& name, const std::string& argument, const std::string& help,
            std::string& target) {
    add(name, argument, help, "", [&target](const std::string& v) {
      if (v.empty()) throw std::invalid_argument("the value is empty");
      target = v;
    });
  }

  void flag(const std::string& name, const std::string& help, bool& target, bool value = true) {
    add(name, "", help, "", [&target, value](const std::string&) { target = value; });
  }

  void number(const std::string& name, const std::string& unit, const std::string& help, double& target,
              Range range = Range::kAny) {
    add(name, unit, help, shown(target),
        [&target, range](const std::string& v) { target = parseNumber(v, range); });
  }

  void count(const std::string& name, const std::string& help, int& target, int least = 1) {
    add(name, "N", help, shown(target), [&target, least](const std::string& v) {
      const double n = parseNumber(v);
      if (n < least || n > 100000.0 || n != std::floor(n)) {
        throw std::invalid_argument("'" + v + "' is not a whole number from " + std::to_string(least) +
                                    " to 100000");
      }
      target = static_cast<int>(n);
    });
  }

  /// Null for a name, without dashes, that is not known.
  const Option* find(const std::string& name) const {
    for (const Option& option : options_) {
      if (option.set && option.name == name) return &option;
    }
    return nullptr;
  }

  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const Option& option : options_) {
      if (option.set) all.push_back(option.name);
    }
    return all;
  }

  /// Of a command line: `--name value` or `--name=value`. Sets nothing. Throws std::invalid_argument with a
  /// message that names the option.
  std::vector<Given> read(const std::vector<std::string>& arguments) const {
    std::vector<Given> given;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
      const std::string& argument = arguments[i];
      const std::size_t equals = argument.find('=');
      const std::string name = argument.substr(0, equals);
      const Option* option = name.rfind("--", 0) == 0 ? find(name.substr(2)) : nullptr;
      if (option == nullptr) throw std::invalid_argument("unknown option '" + name + "' (see --help)");
      std::string value;
      if (equals != std::string::npos) {
        if (option->argument.empty()) throw std::invalid_argument(name + ": takes no value");
        value = argument.substr(equals + 1);
      } else if (!option->argument.empty()) {
        if (++i == arguments.size())
          throw std::invalid_argument(name + ": a value is missing (" + option->argument + ")");
        value = arguments[i];
      }
      given.push_back({option->name, value});
    }
    return given;
  }

  /// Throws std::invalid_argument that begins with the name, without dashes, for a value that is refused.
  void set(const Given& given) const {
    try {
      find(given.name)->set(given.value);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(given.name + ": " + error.what());
    }
  }

  /// A line for each option, as --help shows it.
  void print(std::ostream& out) const {
    for (const Option& option : options_) {
      if (!option.set) {
        out << "\n" << option.help << "\n";
        continue;
      }
      const std::string left = "  --" + option.name + (option.argument.empty() ? "" : " " + option.argument);
      out << std::left << std::setw(38) << left << " " << option.help;
      if (!option.shown_default.empty()) out << " [" << option.shown_default << "]";
      out << "\n";
    }
  }

 private:
  std::vector<Option> options_;
};

}  // namespace rio_t
