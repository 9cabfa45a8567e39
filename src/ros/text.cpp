#include "text.h"

#include <array>
#include <boost/algorithm/string.hpp>
#include <cmath>
#include <cstdint>
#include <locale>
#include <sstream>
#include <vector>

namespace rio_t {

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
  auto left = static_cast<std::uint64_t>(scaled);
  const bool is_negative = value < 0.0 && left != 0;
  std::array<char, 24> digits{};  // filled from the end
  char* first = digits.end();
  for (int i = 0; i <= decimals || left != 0; ++i, left /= 10) {
    if (i == decimals && i > 0) *--first = '.';
    *--first = static_cast<char>('0' + left % 10);
  }
  if (is_negative) *--first = '-';
  text->append(first, digits.end());
}

std::string fixedText(double value, int decimals) {
  std::string text;
  appendFixed(&text, value, decimals);
  return text;
}

std::string fixedTexts(const Eigen::VectorXd& values, int decimals, const std::string& separator) {
  std::string text;
  for (Eigen::Index i = 0; i < values.size(); ++i)
    appendItem(&text, fixedText(values[i], decimals), separator);
  return text;
}

std::string shortText(double value, int digits) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(digits);
  text << value;
  return text.str();
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
