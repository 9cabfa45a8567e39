#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

namespace rio_t {

/// One line of text, as printf() makes it. It is cut after 199 characters.
template <typename... Values>
std::string formatted(const char* text, Values... values) {
  char line[200];
  std::snprintf(line, sizeof line, text, values...);
  return line;
}

/// Appends the decimal number `digits` / 10^`decimals`, with at most 18 decimals.
void appendDecimal(std::string* text, bool is_negative, std::uint64_t digits, int decimals);
/// Appends `value` with that many decimals (at most 12), with a point whatever the locale; ".nan",
/// ".inf", "-.inf" as in YAML. Never minus zero.
void appendFixed(std::string* text, double value, int decimals);

}  // namespace rio_t
