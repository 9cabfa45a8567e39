#include "text.h"

#include <boost/algorithm/string.hpp>
#include <locale>
#include <sstream>
#include <vector>

#include "rio_t/core/format.h"

namespace rio_t {

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
