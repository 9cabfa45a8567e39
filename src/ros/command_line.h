#pragma once

#include <boost/program_options.hpp>
#include <functional>
#include <iosfwd>
#include <list>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/ros/parameters/parameter_value.h"

/// What the command lines of all programs share: boost::program_options with checked numbers, one form of
/// --help, and one meaning of the exit status.
namespace rio_t {

enum ExitStatus {
  kExitOk = 0,
  kExitFailed = 1,      ///< data, a file or a parameter was wrong: there is no result
  kExitUsage = 2,       ///< the command line was wrong: nothing was tried
  kExitNotTrusted = 3,  ///< there is a result, and it is not to be trusted
};

class UsageError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

enum class NumberRange { kAny, kNotNegative, kPositive, kShare };

/// A finite number with a decimal point, whatever the locale. Throws UsageError that says what is wrong.
double parseNumber(const std::string& text, NumberRange range = NumberRange::kAny);
/// Numbers with commas between them: "0.1,0,-2".
std::vector<double> parseNumbers(const std::string& text, std::size_t count);

/// Options of a program, in sections. Each option sets a variable, which must outlive the set. A name has no
/// dashes. The argument is what --help shows for the value, such as M/S or FILE.
class OptionSet {
 public:
  using Given = boost::program_options::parsed_options;
  using Setter = std::function<void(const std::string&)>;  ///< throws std::invalid_argument for a bad value

  explicit OptionSet(const std::string& title);
  /// Starts a section. The last section before the end has --help and --version.
  void section(const std::string& title);

  void flag(const std::string& name, const std::string& help, bool& target, bool value = true);
  void text(const std::string& name, const std::string& argument, const std::string& help,
            std::string& target);
  void number(const std::string& name, const std::string& argument, const std::string& help, double& target,
              NumberRange range = NumberRange::kNotNegative);
  /// A whole number from `least` to 100000.
  void count(const std::string& name, const std::string& help, int& target, int least = 1);
  /// `shown_default` is for --help; empty: none.
  void value(const std::string& name, const std::string& argument, const std::string& help,
             const std::string& shown_default, const Setter& set);
  /// It may be given several times; `set` is called for each value.
  void values(const std::string& name, const std::string& argument, const std::string& help,
              const Setter& set);
  /// Arguments without dashes are values of this option, too.
  void positional(const std::string& name) { positional_.add(name.c_str(), -1); }

  /// Reads `--name value`, `--name=value` and flags; sets nothing. Throws UsageError that names the option.
  Given parse(const std::vector<std::string>& words) const;
  /// Sets what is given. If several sources have an option, the first source counts. Options of other sets
  /// are ignored. Throws UsageError that names the option.
  void set(const std::vector<Given>& sources) const;

  void print(std::ostream& out) const;

 private:
  void add(const std::string& name, const boost::program_options::value_semantic* semantic,
           const std::string& help);

  boost::program_options::options_description all_;
  std::list<boost::program_options::options_description> sections_;
  boost::program_options::positional_options_description positional_;
};

/// The texts of --help besides the options.
struct ProgramText {
  std::string name;      ///< as in `rosrun rio_t NAME`
  std::string usage;     ///< the arguments, one line for each way to call it
  std::string about;     ///< what the program does
  std::string examples;  ///< lines that can be run as they are
  std::string notes;     ///< stands after the options
};

/// Reads the command line into the variables of `options`, and calls `body`. Prints --help and --version. An
/// exception of `body` becomes one line on `err` and the exit status.
int runProgram(const ProgramText& text, OptionSet& options, const std::vector<std::string>& words,
               std::ostream& out, std::ostream& err, const std::function<int()>& body);
/// The same, but `body` gets what was given and sets the options itself.
int runProgramWith(const ProgramText& text, OptionSet& options, const std::vector<std::string>& words,
                   std::ostream& out, std::ostream& err,
                   const std::function<int(const OptionSet::Given&)>& body);

/// Appends a bag. Throws UsageError if it is one of `bags` already.
void addBag(const std::string& bag, std::vector<std::string>& bags);
/// The options of all programs that read bags: BAG... or --bag, --config, --set.
void addBagOptions(OptionSet& options, std::vector<std::string>& bags, std::string& config,
                   ParameterEntries& set);

/// Throws UsageError that names all options that are needed and not given.
void require(const std::vector<std::pair<std::string, bool>>& given_by_name);

/// Whether both name one file, even one that does not exist yet. A program must not write what it reads, nor
/// two results to one file.
bool isSameFile(const std::string& a, const std::string& b);

/// Says why a program that reads `inputs` cannot write `path`; empty if it can. Programs ask before the work,
/// so that a wrong path costs no time.
std::string faultOfOutput(const std::string& path, const std::vector<std::string>& inputs);

/// Writes the file beside `path` and renames it, so that a failure leaves what was there. A link or a device
/// is written in place. A file with another content may be the work of the user, and is kept as PATH~.
/// Returns the name of that copy, or nothing. Throws std::runtime_error that names the path.
std::string writeFile(const std::string& path, const std::string& text);

/// A bar on stderr with the time that is left, for a share of the work done from 0 to 1. Empty if stderr is
/// no terminal. `label` stands before it.
std::function<void(double)> progressBar(const std::string& label = "");

}  // namespace rio_t
