#include "rio_t/core/format.h"

#include <array>
#include <cmath>
#include <locale>
#include <sstream>

namespace rio_t {

void appendDecimal(std::string* text, bool is_negative, std::uint64_t digits, int decimals) {
  std::array<char, 24> reversed{};  // filled from the end
  char* first = reversed.end();
  for (int i = 0; i <= decimals || digits != 0; ++i, digits /= 10) {
    if (i == decimals && i > 0) *--first = '.';
    *--first = static_cast<char>('0' + digits % 10);
  }
  if (is_negative) *--first = '-';
  text->append(first, static_cast<std::size_t>(reversed.end() - first));
}

void appendFixed(std::string* text, double value, int decimals) {
  if (!std::isfinite(value)) {
    *text += std::isnan(value) ? ".nan" : value > 0.0 ? ".inf" : "-.inf";
    return;
  }
  double scale = 1.0;
  for (int i = 0; i < decimals; ++i) scale *= 10.0;
  const double scaled = std::round(std::abs(value) * scale);
  if (scaled > 9e18) {  // beyond 64 bits
    std::ostringstream stream;
    stream.imbue(std::locale::classic());
    stream.precision(decimals);
    stream << std::fixed << value;
    *text += stream.str();
    return;
  }
  const auto digits = static_cast<std::uint64_t>(scaled);
  appendDecimal(text, value < 0.0 && digits != 0, digits, decimals);
}

}  // namespace rio_t
