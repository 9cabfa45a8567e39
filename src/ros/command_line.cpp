#include "command_line.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <locale>
#include <memory>
#include <ostream>
#include <sstream>
#include <system_error>
#include <utility>

#include "rio_t/core/replace_file.h"
#include "text.h"

namespace rio_t {
namespace {

namespace po = boost::program_options;

constexpr unsigned kLineLength = 110;

/// Returns `set` with the name of the option in what it throws.
OptionSet::Setter named(const std::string& name, const OptionSet::Setter& set) {
  return [name, set](const std::string& value) {
    try {
      if (value.empty()) throw UsageError("expected a value, got nothing");
      set(value);
    } catch (const std::invalid_argument& error) {
      const std::string what = error.what();
      const std::string prefix = "--" + name;
      throw UsageError(what.rfind(prefix, 0) == 0 ? what : prefix + ": " + what);
    }
  };
}

/// Returns a name for comparison: `--outputdir`, `--output_dir` and `--out` may all mean --output-dir.
std::string withoutDashes(std::string name) {
  const auto is_dash = [](char c) { return c == '-' || c == '_'; };
  name.erase(std::remove_if(name.begin(), name.end(), is_dash), name.end());
  return name;
}

/// "; did you mean --output-dir?", or nothing: an option that begins as the unknown one does.
std::string guessOf(const std::string& unknown, const po::options_description& options) {
  const std::string begin = withoutDashes(unknown.substr(0, unknown.find('=')));
  if (begin.size() < 3) return "";
  for (const auto& option : options.options())
    if (withoutDashes(option->long_name()).rfind(begin, 0) == 0)
      return "; did you mean --" + option->long_name() + "?";
  return "";
}

bool isRemapping(const std::string& word) {
  return word.rfind("__", 0) == 0 && word.find(":=") != std::string::npos;
}

void printHelp(const ProgramText& text, const OptionSet& options, std::ostream& out) {
  out << text.about << "\n\n";
  std::istringstream usage(text.usage);
  const char* lead = "usage: ";
  for (std::string line; std::getline(usage, line); lead = "       ")
    out << lead << "rosrun rio_t " << text.name << " " << line << "\n";
  out << "\n";
  options.print(out);
  if (!text.notes.empty()) out << "\n" << text.notes;
  out << "\nExamples:\n";
  std::istringstream examples(text.examples);
  for (std::string line; std::getline(examples, line);) out << "  " << line << "\n";
  out << "\nExit status: 0 if it worked, 1 if data, a file or a parameter was wrong or missing, 2 if the "
         "command line was wrong;\nrio_t_bag also has 3, a result that is not to be trusted.\n";
}

/// A line of the progress bar: "[####    ]  40 %, 12 s left".
std::string progressText(const std::string& label, double done, double elapsed) {
  constexpr int kWidth = 40;
  const auto filled = static_cast<std::size_t>(std::clamp(done, 0.0, 1.0) * kWidth);
  std::ostringstream line;
  line << label << "[" << std::string(filled, '#') << std::string(kWidth - filled, ' ') << "] "
       << static_cast<int>(100.0 * done) << " %";
  if (done >= 1.0) {
    line << ", took " << std::lround(elapsed) << " s";
  } else if (done > 0.02) {
    line << ", " << std::lround(elapsed / done * (1.0 - done)) << " s left";
  }
  return line.str();
}

/// The line of a progress bar on stderr. It ends with the bar, so an error gets a line of its own.
class ProgressLine {
 public:
  explicit ProgressLine(std::string label) : label_(std::move(label)) {}
  ~ProgressLine() { end(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(double done) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - started_;
    // \033[K removes what is left of a longer line.
    std::fprintf(stderr, "\r%s\033[K", progressText(label_, done, elapsed.count()).c_str());
    is_open_ = true;
    if (done >= 1.0) end();
  }

 private:
  void end() {
    if (is_open_) std::fprintf(stderr, "\n");
    is_open_ = false;
  }

  const std::string label_;
  const std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
  bool is_open_ = false;
};

/// Copies a file with another content to PATH~, as editors do. Returns the name of the copy, or nothing.
std::string keepOther(const std::string& path, const std::string& text) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (!fs::is_regular_file(path, error) || fs::file_size(path, error) == 0) return "";
  std::ifstream file(path, std::ios::binary);
  if (std::string(std::istreambuf_iterator<char>(file), {}) == text) return "";
  std::string backup = path + "~";
  if (!fs::copy_file(path, backup, fs::copy_options::overwrite_existing, error) || error)
    throw std::runtime_error(path + ": cannot be kept as " + backup + " (" + error.message() + ")");
  return backup;
}

}  // namespace

double parseNumber(const std::string& text, NumberRange range) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double value = 0.0;
  stream >> value;
  const bool whole = !stream.fail() && stream.peek() == std::istringstream::traits_type::eof();
  if (!whole || !std::isfinite(value)) throw UsageError("'" + text + "' is not a number");
  if (range == NumberRange::kNotNegative && value < 0.0) throw UsageError("'" + text + "' is below 0");
  if (range == NumberRange::kPositive && value <= 0.0) throw UsageError("'" + text + "' is not above 0");
  if (range == NumberRange::kShare && (value < 0.0 || value > 1.0))
    throw UsageError("'" + text + "' is not within 0 and 1");
  return value;
}

std::vector<double> parseNumbers(const std::string& text, std::size_t count) {
  std::vector<double> values;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) values.push_back(parseNumber(part));
  if (values.size() != count) {
    throw UsageError("'" + text + "' is not " + std::to_string(count) + " numbers with commas between them");
  }
  return values;
}

OptionSet::OptionSet(const std::string& title) { section(title); }

void OptionSet::section(const std::string& title) { sections_.emplace_back(title, kLineLength); }

void OptionSet::add(const std::string& name, const po::value_semantic* semantic, const std::string& help) {
  const boost::shared_ptr<po::option_description> option(
      new po::option_description(name.c_str(), semantic, help.c_str()));
  sections_.back().add(option);
  all_.add(option);
}

void OptionSet::flag(const std::string& name, const std::string& help, bool& target, bool value) {
  add(name, po::bool_switch()->notifier([&target, value](bool given) {
    if (given) target = value;
  }),
      help);
}

void OptionSet::text(const std::string& name, const std::string& argument, const std::string& help,
                     std::string& target) {
  value(name, argument, help, "", [&target](const std::string& text) { target = text; });
}

void OptionSet::number(const std::string& name, const std::string& argument, const std::string& help,
                       double& target, NumberRange range) {
  value(name, argument, help, shortText(target, 10),
        [&target, range](const std::string& text) { target = parseNumber(text, range); });
}

void OptionSet::count(const std::string& name, const std::string& help, int& target, int least) {
  value(name, "N", help, std::to_string(target), [&target, least](const std::string& text) {
    const double n = parseNumber(text);
    if (n < least || n > 100000.0 || n != std::floor(n)) {
      throw UsageError("'" + text + "' is not a whole number from " + std::to_string(least) + " to 100000");
    }
    target = static_cast<int>(n);
  });
}

void OptionSet::value(const std::string& name, const std::string& argument, const std::string& help,
                      const std::string& shown_default, const Setter& set) {
  add(name, po::value<std::string>()->value_name(argument)->notifier(named(name, set)),
      shown_default.empty() ? help : help + " [" + shown_default + "]");
}

void OptionSet::values(const std::string& name, const std::string& argument, const std::string& help,
                       const Setter& set) {
  using Words = std::vector<std::string>;
  add(name, po::value<Words>()->value_name(argument)->notifier([set = named(name, set)](const Words& words) {
    for (const std::string& word : words) set(word);
  }),
      help);
}

OptionSet::Given OptionSet::parse(const std::vector<std::string>& words) const {
  std::vector<std::string> own;  // without the remappings that roslaunch adds
  std::remove_copy_if(words.begin(), words.end(), std::back_inserter(own), isRemapping);
  // No guessing: `--out` must not become `--output-dir`.
  const int style = po::command_line_style::default_style & ~po::command_line_style::allow_guessing;
  try {
    return po::command_line_parser(own).options(all_).positional(positional_).style(style).run();
  } catch (const po::unknown_option& error) {
    throw UsageError(error.what() + guessOf(error.get_option_name(), all_));
  } catch (const po::error& error) {
    throw UsageError(error.what());
  }
}

void OptionSet::set(const std::vector<Given>& sources) const {
  try {
    po::variables_map values;
    for (const Given& source : sources) {
      Given mine(&all_);
      for (const po::option& option : source.options)
        if (all_.find_nothrow(option.string_key, false) != nullptr) mine.options.push_back(option);
      po::store(mine, values);
    }
    po::notify(values);
  } catch (const po::error& error) {
    throw UsageError(error.what());
  }
}

void OptionSet::print(std::ostream& out) const {
  for (const po::options_description& section : sections_) out << section << "\n";
}

int runProgramWith(const ProgramText& text, OptionSet& options, const std::vector<std::string>& words,
                   std::ostream& out, std::ostream& err,
                   const std::function<int(const OptionSet::Given&)>& body) {
  bool help = false, version = false;
  options.section("Help");
  options.flag("help,h", "prints this text", help);
  options.flag("version", "prints the version", version);
  try {
    // Before anything else is read, so that --help also works with a wrong command line.
    for (const std::string& word : words) help = help || word == "--help" || word == "-h";
    version = words == std::vector<std::string>{"--version"};
    int status = kExitOk;
    if (help) {
      printHelp(text, options, out);
    } else if (version) {
      out << text.name << " of rio_t " RIO_T_VERSION "\n";
    } else {
      status = body(options.parse(words));
    }
    if (!out.flush()) throw std::runtime_error("the output cannot be written (disk full?)");
    return status;
  } catch (const UsageError& error) {
    err << text.name << ": " << error.what() << " (see --help)\n";
    return kExitUsage;
  } catch (const std::bad_alloc&) {
    err << text.name << ": out of memory\n";
    return kExitFailed;
  } catch (const std::exception& error) {
    err << text.name << ": " << error.what() << "\n";
    return kExitFailed;
  }
}

int runProgram(const ProgramText& text, OptionSet& options, const std::vector<std::string>& words,
               std::ostream& out, std::ostream& err, const std::function<int()>& body) {
  return runProgramWith(text, options, words, out, err, [&](const OptionSet::Given& given) {
    options.set({given});
    return body();
  });
}

void addBag(const std::string& bag, std::vector<std::string>& bags) {
  for (const std::string& other : bags)
    if (isSameFile(bag, other)) throw UsageError(bag + ": expected each bag once");
  bags.push_back(bag);
}

void addBagOptions(OptionSet& options, std::vector<std::string>& bags, std::string& config,
                   ParameterEntries& set) {
  options.values("bag", "BAG", "a bag with IMU and radar; `--bag` itself may be left out",
                 [&bags](const std::string& bag) { addBag(bag, bags); });
  options.positional("bag");
  options.text("config", "NAME_OR_PATH", "irs, ti_mmwave, ... of the package's config/, or a YAML file",
               config);
  options.values(
      "set", "key=value",
      "sets a parameter on top of the configuration; left/key=value sets it for the radar left; may be "
      "repeated",
      [&set](const std::string& text) { set.push_back(parseAssignment(text)); });
}

bool isSameFile(const std::string& a, const std::string& b) {
  namespace fs = std::filesystem;
  if (a.empty() || b.empty()) return false;
  std::error_code error;  // there is one for files that do not exist
  if (fs::equivalent(a, b, error)) return true;
  return fs::weakly_canonical(fs::absolute(a)) == fs::weakly_canonical(fs::absolute(b));
}

std::string faultOfOutput(const std::string& path, const std::vector<std::string>& inputs) {
  namespace fs = std::filesystem;
  for (const std::string& input : inputs)
    if (isSameFile(path, input)) return path + ": expected another file than " + input + ", which is read";
  if (fs::is_directory(path)) return path + ": expected a file, this is a folder";
  if (isWrittenInPlace(path)) return access(path.c_str(), W_OK) == 0 ? "" : path + ": cannot be written";
  const fs::path folder = fs::absolute(path).parent_path();
  if (!fs::is_directory(folder)) return path + ": there is no folder " + folder.string();
  if (access(folder.c_str(), W_OK) != 0) return path + ": folder " + folder.string() + " cannot be written";
  return "";
}

std::string writeFile(const std::string& path, const std::string& text) {
  std::string backup = keepOther(path, text);
  replaceFile(path, text);
  return backup;
}

void require(const std::vector<std::pair<std::string, bool>>& given_by_name) {
  std::string missing;
  for (const auto& [name, given] : given_by_name)
    if (!given) missing += " " + name;
  if (!missing.empty()) throw UsageError("missing argument" + missing);
}

std::function<void(double)> progressBar(const std::string& label) {
  if (isatty(STDERR_FILENO) == 0) return nullptr;
  return [line = std::make_shared<ProgressLine>(label)](double done) { line->show(done); };
}

}  // namespace rio_t
