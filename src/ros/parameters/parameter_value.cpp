#include "rio_t/ros/parameters/parameter_value.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <locale>
#include <map>
#include <sstream>
#include <stdexcept>

#include "../text.h"
#include "parameter_list.h"

namespace rio_t {
namespace {

/// Reads all of `text` as a T, with a decimal point whatever the locale of the machine. std::regex would take
/// one stack frame a letter, and a parameter file may have long lines.
template <typename T>
bool parseWhole(const std::string& text, T* value) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  stream >> std::noskipws >> *value;
  return !stream.fail() && stream.peek() == std::istringstream::traits_type::eof();
}

bool isOneOf(const std::string& text, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(), [&](const char* word) { return text == word; });
}

ParameterValue fromYaml(const YAML::Node& node) {
  if (!node.IsDefined() || node.IsNull()) return {};
  if (node.IsScalar() && node.Tag() == "!") return {node.Scalar()};  // quoted: text, whatever it looks like
  if (node.IsScalar()) return parsePlainScalar(node.Scalar());
  if (node.IsMap()) return {ParameterValue::Map{}};  // no deeper than a section
  ParameterValue::List list;
  for (const auto& element : node) {
    // No deeper: no parameter takes lists of lists, and with anchors a list may contain itself.
    list.push_back(element.IsSequence() ? ParameterValue{ParameterValue::Map{}} : fromYaml(element));
  }
  return {std::move(list)};
}

/// Throws if a document begins where the one before began: yaml-cpp would read a stray comma for ever.
class Progress : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (mark.pos == begin_) throw YAML::ParserException(mark, "unexpected character");
    begin_ = mark.pos;
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
  }
  void OnMapEnd() override {}

 private:
  int begin_ = -1;
};

/// Returns a hint for what yaml-cpp only calls "illegal map value": a tab in that line, counted from 0.
std::string hintOfTab(const std::string& yaml, int line) {
  std::istringstream lines(yaml);
  std::string text;
  for (int k = 0; k <= line; ++k)
    if (!std::getline(lines, text)) return "";
  return text.find('\t') == std::string::npos ? "" : "; a tab cannot indent: use spaces";
}

/// Returns the origin of a line of the YAML text, for messages.
using OriginOfLine = std::function<std::string(int line)>;

/// Returns the entries of a map, and of the maps in it if `sections`.
ParameterEntries fromYamlMap(const YAML::Node& map, bool sections, const OriginOfLine& originOf) {
  ParameterEntries entries;
  std::map<std::string, int> line_of;
  for (const auto& item : map) {
    const int line = item.first.Mark().line + 1;
    const std::string origin = originOf(line);
    if (!item.first.IsScalar())
      throw std::runtime_error(origin + ": expected `key: value` with text as the key");
    const std::string key = item.first.Scalar();
    const auto [first, is_new] = line_of.emplace(key, line);
    if (!is_new) {
      throw std::runtime_error(origin + ": " + key + ": expected each key once, it stands in line " +
                               std::to_string(first->second) + " too");
    }
    ParameterValue value = sections && item.second.IsMap()
                               ? ParameterValue{fromYamlMap(item.second, false, originOf)}
                               : fromYaml(item.second);
    entries.push_back({key, std::move(value), origin});
  }
  return entries;
}

/// Whether text without quotes reads back as text in every YAML reader.
bool isPlainText(const std::string& text) {
  const auto isPlain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '/' || c == '.';
  };
  return !text.empty() && std::all_of(text.begin(), text.end(), isPlain) &&
         std::holds_alternative<std::string>(parsePlainScalar(text).data);
}

void emit(YAML::Emitter& out, const ParameterValue& value) {
  struct Emit {
    void operator()(std::monostate) const { out << YAML::Null; }
    void operator()(bool value) const { out << value; }
    void operator()(std::int64_t value) const { out << value; }
    void operator()(double value) const { out << numberText(value); }
    void operator()(const std::string& value) const {
      if (!isPlainText(value)) out << YAML::DoubleQuoted;
      out << value;
    }
    void operator()(const ParameterValue::List& list) const {
      out << YAML::Flow << YAML::BeginSeq;
      for (const ParameterValue& element : list) emit(out, element);
      out << YAML::EndSeq;
    }
    void operator()(const ParameterValue::Map& map) const {
      out << YAML::Flow << YAML::BeginMap;
      for (const ParameterEntry& entry : map) {
        out << YAML::Key << entry.key << YAML::Value;
        emit(out, entry.value);
      }
      out << YAML::EndMap;
    }
    YAML::Emitter& out;
  };
  std::visit(Emit{out}, value.data);
}

}  // namespace

std::string ParameterValue::describe() const {
  struct Describe {
    std::string operator()(std::monostate) const { return "nothing"; }
    std::string operator()(bool value) const { return value ? "true" : "false"; }
    std::string operator()(std::int64_t value) const { return std::to_string(value); }
    std::string operator()(double value) const { return shortText(value, 12); }
    std::string operator()(const std::string& value) const { return '"' + value + '"'; }
    std::string operator()(const List& list) const {
      std::string text = "[";
      for (const ParameterValue& value : list) text += (text.size() > 1 ? ", " : "") + value.describe();
      return text + "]";
    }
    std::string operator()(const Map&) const { return "nested keys"; }
  };
  return std::visit(Describe{}, data);
}

ParameterValue listOf(const Eigen::VectorXd& numbers) {
  ParameterValue::List list;
  for (Eigen::Index i = 0; i < numbers.size(); ++i) list.emplace_back().data = numbers[i];
  return {std::move(list)};
}

ParameterValue parsePlainScalar(const std::string& text) {
  // The words of YAML 1.1, since that is what the ROS parameter server reads.
  if (isOneOf(text, {"", "~", "null", "Null", "NULL"})) return {};
  if (isOneOf(text, {"true", "True", "TRUE", "yes", "Yes", "YES", "on", "On", "ON"})) return {true};
  if (isOneOf(text, {"false", "False", "FALSE", "no", "No", "NO", "off", "Off", "OFF"})) return {false};
  if (isOneOf(text, {".nan", ".NaN", ".NAN", "nan", "NaN"}))
    return {std::numeric_limits<double>::quiet_NaN()};
  if (isOneOf(text, {".inf", ".Inf", ".INF", "+.inf", "inf"}))
    return {std::numeric_limits<double>::infinity()};
  if (isOneOf(text, {"-.inf", "-.Inf", "-.INF", "-inf"})) return {-std::numeric_limits<double>::infinity()};

  std::int64_t whole = 0;
  if (parseWhole(text, &whole)) return {whole};
  double real = 0.0;
  if (parseWhole(text, &real)) return {real};
  return {text};
}

std::string ParameterValue::yaml() const {
  YAML::Emitter out;
  out << YAML::Flow;
  emit(out, *this);
  return out.c_str();
}

ParameterEntries readParameterFile(const std::string& path) {
  if (std::filesystem::is_directory(path)) {
    throw std::runtime_error(path + ": expected a YAML file with one `key: value` a line, this is a folder");
  }
  std::ifstream file(path);
  if (!file)
    throw std::runtime_error(path + ": cannot be read; expected a YAML file with one `key: value` a line");
  return readParameters({std::istreambuf_iterator<char>(file), {}}, path);
}

ParameterEntries readParameters(const std::string& yaml, const std::string& name) {
  YAML::Node root;
  try {
    std::istringstream stream(yaml);
    YAML::Parser parser(stream);
    Progress progress;
    while (parser.HandleNextDocument(progress)) {
    }
    for (const YAML::Node& document : YAML::LoadAll(yaml)) {
      if (document.IsNull()) continue;
      if (!root.IsNull())
        throw std::runtime_error(name + ":" + std::to_string(document.Mark().line + 1) +
                                 ": expected one YAML document, here begins a second one");
      root.reset(document);
    }
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(name + ":" + std::to_string(error.mark.line + 1) + ": not YAML (" + error.msg +
                             hintOfTab(yaml, error.mark.line) + "); expected one `key: value` a line");
  }
  if (root.IsNull()) return {};
  if (!root.IsMap()) throw std::runtime_error(name + ":1: expected one `key: value` a line");
  return fromYamlMap(root, true, [&](int line) { return name + ":" + std::to_string(line); });
}

bool isFromServer(const ParameterEntry& entry) { return entry.origin.rfind(kParameterServer, 0) == 0; }

ParameterEntry parseAssignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw std::invalid_argument("--set " + text + ": expected key=value");
  }
  try {
    const YAML::Node value = YAML::Load(text.substr(equals + 1));
    const std::string key = text.substr(0, equals);
    if (!value.IsMap()) return {key, fromYaml(value), kCommandLine};
    return {key, {fromYamlMap(value, false, [](int) { return kCommandLine; })}, kCommandLine};
  } catch (const YAML::Exception& error) {
    throw std::invalid_argument("--set " + text + ": the value is not YAML (" + error.msg + ")");
  } catch (const std::runtime_error& error) {
    throw std::invalid_argument(error.what());
  }
}

}  // namespace rio_t
