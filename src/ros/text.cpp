#include "text.h"

#include <array>
#include <boost/algorithm/string.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <locale>
#include <sstream>
#include <vector>

namespace rio_t {
namespace {

void appendDigits(std::string* text, std::uint64_t value, int at_least) {
  std::array<char, 20> digits{};
  const char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  const auto count = static_cast<int>(end - digits.data());
  if (count < at_least) text->append(static_cast<std::size_t>(at_least - count), '0');
  text->append(digits.data(), static_cast<std::size_t>(count));
}

}  // namespace

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
  const auto whole = static_cast<std::uint64_t>(scaled);
  const auto divisor = static_cast<std::uint64_t>(scale);
  if (value < 0.0 && whole != 0) text->push_back('-');
  appendDigits(text, whole / divisor, 1);
  if (decimals == 0) return;
  text->push_back('.');
  appendDigits(text, whole % divisor, decimals);
}

std::string fixedText(double value, int decimals) {
  std::string text;
  appendFixed(&text, value, decimals);
  return text.find_first_of("123456789in") == std::string::npos && text.front() == '-' ? text.substr(1)
                                                                                       : text;
}

void appendItem(std::string* list, const std::string& item, const std::string& separator) {
  *list += (list->empty() ? "" : separator) + item;
}

std::string wrapped(const std::string& text, const std::string& indent, std::size_t width) {
  std::vector<std::string> words;
  boost::algorithm::split(words, text, boost::algorithm::is_any_of(" "));
  std::string result = words.front();
  std::size_t column = indent.size() + result.size();
  for (std::size_t i = 1; i < words.size(); ++i) {
    const bool fits = column + 1 + words[i].size() <= width;
    result += (fits ? " " : "\n" + indent) + words[i];
    column = (fits ? column + 1 : indent.size()) + words[i].size();
  }
  return result;
}

std::string prefixOf(const std::string& radar) { return radar.empty() ? "" : radar + "/"; }

std::string suffixOf(const std::string& radar) { return radar.empty() ? "" : "_" + radar; }

}  // namespace rio_t
