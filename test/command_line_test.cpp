#include "../src/ros/command_line.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>
#include <string>

#include "../src/ros/temporary_folder.h"
#include "full_disk.h"

namespace rio_t {
namespace {

const ProgramText kText = {"tool", "FILE...\n", "Tests.", "rosrun rio_t tool a.txt\n", ""};

/// A program with an option of each kind.
class CommandLine : public testing::Test {
 protected:
  /// Runs it; what it set is in the members.
  int run(
      const std::vector<std::string>& words, const std::function<int()>& body = [] { return 0; }) {
    OptionSet options("Options");
    options.values("file", "FILE", "files", [this](const std::string& file) { files_.push_back(file); });
    options.positional("file");
    options.number("speed", "M/S", "how fast", speed_, NumberRange::kPositive);
    options.number("shift", "S", "may be negative", shift_, NumberRange::kAny);
    options.count("count", "how many", count_);
    options.flag("quiet", "says less", quiet_);
    options.text("out", "FILE", "goes there", out_file_);
    options.text("output-dir", "FOLDER", "goes there", folder_);
    std::ostringstream out, err;
    const int status = runProgram(kText, options, words, out, err, body);
    out_ = out.str();
    err_ = err.str();
    return status;
  }

  std::vector<std::string> files_;
  double speed_ = 1.5, shift_ = 0.0;
  int count_ = 2;
  bool quiet_ = false;
  std::string out_file_, folder_, out_, err_;
};

TEST_F(CommandLine, BothFormsOfAValueAreRead) {
  EXPECT_EQ(run({"a.txt", "--speed", "2.5", "--shift=-0.1", "--count=3", "b.txt", "--quiet"}), kExitOk);
  EXPECT_EQ(files_, (std::vector<std::string>{"a.txt", "b.txt"}));
  EXPECT_EQ(speed_, 2.5);
  EXPECT_EQ(shift_, -0.1);
  EXPECT_EQ(count_, 3);
  EXPECT_TRUE(quiet_);
  EXPECT_EQ(err_, "");
}

TEST_F(CommandLine, ANegativeNumberIsAValue) {
  EXPECT_EQ(run({"--shift", "-0.25"}), kExitOk);
  EXPECT_EQ(shift_, -0.25);
}

TEST_F(CommandLine, WhatIsNotGivenKeepsItsDefault) {
  EXPECT_EQ(run({}), kExitOk);
  EXPECT_EQ(speed_, 1.5);
  EXPECT_FALSE(quiet_);
}

TEST_F(CommandLine, NothingIsGuessed) {
  EXPECT_EQ(run({"--output", "x"}), kExitUsage);
  EXPECT_NE(err_.find("unrecognised option '--output'"), std::string::npos) << err_;
  EXPECT_EQ(run({"--out", "x"}), kExitOk);
  EXPECT_EQ(out_file_, "x");
  EXPECT_EQ(folder_, "");
}

TEST_F(CommandLine, WrongValuesAreNamed) {
  const std::pair<std::vector<std::string>, std::string> wrong[] = {
      {{"--speed", "fast"}, "tool: --speed: 'fast' is not a number (see --help)\n"},
      {{"--speed", "0"}, "tool: --speed: '0' is not above 0 (see --help)\n"},
      {{"--speed", "nan"}, "tool: --speed: 'nan' is not a number (see --help)\n"},
      {{"--speed", "1,5"}, "tool: --speed: '1,5' is not a number (see --help)\n"},
      {{"--count", "2.5"}, "tool: --count: '2.5' is not a whole number from 1 to 100000 (see --help)\n"},
  };
  for (const auto& [words, message] : wrong) {
    EXPECT_EQ(run(words), kExitUsage);
    EXPECT_EQ(err_, message);
  }
  EXPECT_EQ(run({"--speed"}), kExitUsage);
  EXPECT_EQ(run({"--quiet=1"}), kExitUsage);
  EXPECT_EQ(run({"--speed=1", "--speed=2"}), kExitUsage);
}

TEST_F(CommandLine, TheExitStatusSaysWhatHappened) {
  EXPECT_EQ(run({}, [] { return static_cast<int>(kExitNotTrusted); }), 3);
  EXPECT_EQ(run({}, []() -> int { throw std::runtime_error("disk full"); }), kExitFailed);
  EXPECT_EQ(err_, "tool: disk full\n");
  EXPECT_EQ(run({}, []() -> int { throw UsageError("a file is missing"); }), kExitUsage);
}

TEST_F(CommandLine, AnOutputThatCannotBeWrittenIsAFault) {
  for (const char* word : {"--help", "--version", "a.txt"}) {
    OptionSet options("Options");
    options.values("file", "FILE", "files", [](const std::string& /*file*/) {});
    options.positional("file");
    std::ofstream full("/dev/full");
    std::ostringstream err;
    const auto body = [&] {
      full << "result\n";
      return 0;
    };
    EXPECT_EQ(runProgram(kText, options, {word}, full, err, body), kExitFailed) << word;
    EXPECT_EQ(err.str(), "tool: the output cannot be written (disk full?)\n") << word;
  }
}

TEST_F(CommandLine, HelpAndVersionComeBeforeAllElse) {
  EXPECT_EQ(run({"--wrong", "--help"}), kExitOk);
  for (const char* part : {"usage: rosrun rio_t tool FILE...", "--speed M/S", "how fast [1.5]", "--quiet",
                           "Examples:\n  rosrun rio_t tool a.txt\n", "Exit status"})
    EXPECT_NE(out_.find(part), std::string::npos) << part << " not in " << out_;
  EXPECT_EQ(run({"--version"}), kExitOk);
  EXPECT_EQ(out_.rfind("tool of rio_t ", 0), 0U) << out_;
}

TEST_F(CommandLine, WhatRoslaunchAddsIsSkipped) {
  EXPECT_EQ(run({"a.txt", "__name:=node", "__log:=/tmp/x.log"}), kExitOk);
  EXPECT_EQ(files_, std::vector<std::string>{"a.txt"});
}

TEST(OptionSet, TheFirstSourceCounts) {
  double x = 0.0, y = 0.0;
  std::vector<std::string> steps;
  OptionSet options("");
  options.number("x", "S", "", x);
  options.number("y", "S", "", y);
  options.values("step", "S", "", [&](const std::string& step) { steps.push_back(step); });
  const OptionSet::Given own = options.parse({"--x=1", "--step=a", "--step=b"});
  const OptionSet::Given outside = options.parse({"--x=2", "--y=3", "--step=c"});
  options.set({own, outside});
  EXPECT_EQ(x, 1.0);
  EXPECT_EQ(y, 3.0);
  EXPECT_EQ(steps, (std::vector<std::string>{"a", "b"}));
}

/// What `body` prints on stderr if that is a terminal.
std::string onTerminal(const std::function<void()>& body) {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  if (terminal < 0 || grantpt(terminal) != 0 || unlockpt(terminal) != 0) return "no terminal";
  std::array<char, 100> name = {};
  if (ptsname_r(terminal, name.data(), name.size()) != 0) return "no name";
  const int end = open(name.data(), O_RDWR | O_NOCTTY), saved = dup(STDERR_FILENO);
  dup2(end, STDERR_FILENO);
  body();
  dup2(saved, STDERR_FILENO);
  std::string text;
  std::array<char, 1000> part = {};
  pollfd readable{terminal, POLLIN, 0};
  while (poll(&readable, 1, 200) > 0) {
    const ssize_t count = read(terminal, part.data(), part.size());
    if (count <= 0) break;
    text.append(part.data(), static_cast<std::size_t>(count));
  }
  for (const int file : {saved, end, terminal}) close(file);
  return text;
}

TEST(ProgressBar, AnErrorGetsALineOfItsOwn) {
  const std::string failed = onTerminal([] { progressBar("a.bag ")(0.4); });
  EXPECT_NE(failed.find("a.bag ["), std::string::npos) << failed;
  EXPECT_EQ(std::count(failed.begin(), failed.end(), '\n'), 1) << failed;
  EXPECT_EQ(failed.back(), '\n');
  const std::string finished = onTerminal([] {
    const std::function<void(double)> bar = progressBar();
    const std::function<void(double)> copy = bar;  // as the run takes one
    bar(0.5);
    copy(1.0);
  });
  EXPECT_EQ(std::count(finished.begin(), finished.end(), '\n'), 1) << finished;
  EXPECT_EQ(finished.back(), '\n');
}

TEST(SameFile, IsOneWhereverItIsNamedFrom) {
  const TemporaryFolder temporary;
  const std::string file = temporary.path() + "/a.txt";
  EXPECT_TRUE(isSameFile(file, temporary.path() + "/./a.txt")) << "it does not exist yet";
  EXPECT_FALSE(isSameFile(file, temporary.path() + "/b.txt"));
  EXPECT_FALSE(isSameFile("", ""));
  std::ofstream(file) << "content";
  std::filesystem::create_hard_link(file, temporary.path() + "/link.txt");
  EXPECT_TRUE(isSameFile(file, temporary.path() + "/link.txt"));
}

std::string contentOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

TEST(OutputFile, AFailureLeavesWhatWasThere) {
  const TemporaryFolder temporary;
  const std::string file = temporary.path() + "/a.yaml";
  writeFile(file, "old");
  {
    const FullDisk disk(1000);
    EXPECT_THROW(writeFile(file, std::string(10000, 'x')), std::runtime_error);
  }
  EXPECT_EQ(contentOf(file), "old");
  EXPECT_FALSE(std::filesystem::exists(file + ".part"));
  writeFile(file, "new");
  EXPECT_EQ(contentOf(file), "new");
}

TEST(OutputFile, ALinkStaysALink) {
  const TemporaryFolder temporary;
  const std::string file = temporary.path() + "/a.yaml", link = temporary.path() + "/link.yaml";
  writeFile(file, "old");
  std::filesystem::create_symlink(file, link);
  EXPECT_EQ(faultOfOutput(link, {}), "");
  writeFile(link, "new");
  EXPECT_EQ(contentOf(file), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(link));
}

TEST(OutputFile, AnotherContentIsKept) {
  const TemporaryFolder temporary;
  const std::string file = temporary.path() + "/a.yaml", link = temporary.path() + "/link.yaml";
  EXPECT_EQ(writeFile(file, "mine"), "");
  EXPECT_EQ(writeFile(file, "mine"), "");
  EXPECT_EQ(writeFile(file, "new"), file + "~");
  EXPECT_EQ(contentOf(file + "~"), "mine");
  std::filesystem::create_symlink(file, link);
  EXPECT_EQ(writeFile(link, "newer"), link + "~");
  EXPECT_EQ(contentOf(link + "~"), "new");
  EXPECT_EQ(writeFile("/dev/null", "text"), "");
}

TEST(OutputFile, WhatCannotBeWrittenIsKnownBeforeTheWork) {
  const TemporaryFolder temporary;
  const std::string file = temporary.path() + "/a.yaml";
  const auto expectFault = [](const std::string& fault, const std::string& part) {
    EXPECT_NE(fault.find(part), std::string::npos) << fault;
  };
  EXPECT_EQ(faultOfOutput(file, {temporary.path() + "/b.yaml"}), "");
  expectFault(faultOfOutput(file, {temporary.path() + "/./a.yaml"}), "expected another file");
  expectFault(faultOfOutput(temporary.path(), {}), "this is a folder");
  expectFault(faultOfOutput(temporary.path() + "/none/a.yaml", {}), "there is no folder");
  // Root writes anywhere. access() judges by the real user, who is somebody else for a moment.
  constexpr uid_t kNobody = 65534, kSame = -1;
  const uid_t user = getuid();
  if (user == 0 && setreuid(kNobody, kSame) != 0) GTEST_SKIP() << "root can be nobody else here";
  std::filesystem::permissions(temporary.path(), std::filesystem::perms::owner_read);
  const std::string fault = faultOfOutput(file, {});
  std::filesystem::permissions(temporary.path(), std::filesystem::perms::owner_all);
  ASSERT_EQ(setreuid(user, kSame), 0);
  expectFault(fault, temporary.path() + " cannot be written");
}

}  // namespace
}  // namespace rio_t
