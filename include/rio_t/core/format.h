#pragma once

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

}  // namespace rio_t
