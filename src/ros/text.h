#pragma once

#include <Eigen/Core>
#include <string>

/// Texts for people and files.
namespace rio_t {

/// As appendFixed (core/format.h).
std::string fixedText(double value, int decimals);
/// Several values: "1.20, -0.30, 0.05".
std::string fixedTexts(const Eigen::VectorXd& values, int decimals, const std::string& separator = ", ");

/// With at most that many digits, with a point whatever the locale: "0.25", "1e-05".
std::string shortText(double value, int digits);

/// Appends an item to a list in a text: "a, b".
void appendItem(std::string* list, const std::string& item, const std::string& separator = ", ");

/// Breaks a text into lines of `width`. All but the first begin with `indent`, and the first leaves room for
/// it.
std::string wrapped(const std::string& text, const std::string& indent, std::size_t width);

/// Prefix of a radar's keys: "left/"; empty if there is one radar.
std::string prefixOf(const std::string& radar);
/// Suffix of its files and of its keys in summary.yaml: "_left"; likewise.
std::string suffixOf(const std::string& radar);

}  // namespace rio_t
