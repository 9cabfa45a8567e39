// Prints the parameters, with the texts of the registry.
#include "../text.h"
#include "parameter_list.h"

namespace rio_t {
namespace {

constexpr std::size_t kLineLength = 110;
const char* const kFirst = "The parameters that matter first";

std::string expectedText(const ParameterDescription& about) {
  return (about.unit.empty() ? "" : "[" + about.unit + "] ") + about.expected +
         (about.of_radar ? "; per radar" : "");
}

/// The parameters in the order for people: first those that matter first, then section by section.
/// `section(title)` is called before each section, `one(parameter)` for each parameter.
template <typename Section, typename One>
void visit(const ParameterList& list, const Section& section, const One& one) {
  section(kFirst);
  for (const Parameter& parameter : list.all()) {
    if (parameter.description.first) one(parameter);
  }
  std::string group;
  for (const Parameter& parameter : list.all()) {
    if (parameter.description.first) continue;
    if (parameter.description.group != group) section(group = parameter.description.group);
    one(parameter);
  }
}

/// The section of a radar, as YAML: only what differs from the top level.
std::string sectionYaml(const Config& top_level, const Config& radar) {
  Config own = radar;
  Config base = withoutSection(top_level, radar.radar_name);
  const ParameterList own_list = parametersOf(own);
  const ParameterList base_list = parametersOf(base);
  std::string lines;
  for (std::size_t i = 0; i < own_list.all().size(); ++i) {
    const Parameter& parameter = own_list.all()[i];
    const std::string value = parameter.get().yaml();
    if (!parameter.description.of_radar || value == base_list.all()[i].get().yaml()) continue;
    lines += "  " + parameter.description.key + ": " + value + "\n";
  }
  return "# --- Radar " + radar.radar_name + ": what differs from the above\n\n" + radar.radar_name + ":" +
         (lines.empty() ? " {}\n" : "\n" + lines);
}

}  // namespace

std::vector<ParameterDescription> parameterDescriptions() {
  std::vector<ParameterDescription> descriptions;
  Config config;
  const ParameterList list = parametersOf(config);
  for (const Parameter& parameter : list.all()) descriptions.push_back(parameter.description);
  return descriptions;
}

std::string toYaml(const Config& config) {
  std::string yaml =
      "# Every parameter of rio_t with its default. Written by `rio_t_bag --print-config`; do not edit by "
      "hand.\n"
      "# A configuration of your own names only what differs. Unknown keys are refused.\n"
      "# Angles are in radians, all else is in SI units, unless the name of the key says otherwise.\n";
  Config copy = config;  // a list needs members that it could set
  visit(
      parametersOf(copy), [&](const std::string& title) { yaml += "\n# --- " + title + "\n"; },
      [&](const Parameter& parameter) {
        const ParameterDescription& about = parameter.description;
        yaml += "\n# " + wrapped(about.description, "# ", kLineLength) + "\n# " + expectedText(about) + "\n" +
                about.key + ": " + parameter.get().yaml() + "\n";
      });
  for (const Config& radar : config.radars) yaml += "\n" + sectionYaml(config, radar);
  return yaml;
}

std::string parametersMarkdown() {
  std::string text =
      "<!-- Written by `rio_t_bag --print-parameters`; do not edit by hand. -->\n"
      "# Parameters\n\n"
      "A configuration is a YAML file that names only what differs from the defaults below. The bag programs "
      "take it with `--config`, the launch files with `config:=`, the live node alone with `_config:=`. "
      "`--set key=value` changes one parameter. An "
      "unknown key or a value out of range is an error that names the key.\n\n"
      "Angles are in radians, all else is in SI units, unless the name of the key says otherwise. A rotation "
      "is a quaternion x, y, z, w. \"Per radar\" means that each of several radars may have its own value in "
      "its section.\n";
  Config config;
  visit(
      parametersOf(config), [&](const std::string& title) { text += "\n## " + title + "\n"; },
      [&](const Parameter& parameter) {
        const ParameterDescription& about = parameter.description;
        text += "\n### `" + about.key + "`\n\n" + wrapped(about.description, "", kLineLength) +
                "\n\nDefault: `" + parameter.get().yaml() + "`" +
                (about.unit.empty() ? "" : " " + about.unit) + ". Expected: " + about.expected +
                (about.of_radar ? ". Per radar" : "") + ".\n";
      });
  return text;
}

}  // namespace rio_t
