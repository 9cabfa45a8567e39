// Files of trajectories, and times from text: what is read and written, and what is refused.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <string>

#include "../src/ros/temporary_folder.h"
#include "evaluation_setup.h"
#include "full_disk.h"
#include "rio_t/evaluation/trajectory.h"

namespace rio_t {
namespace {

// --- Time from text ---

TEST(ParseTime, KeepsEveryNanosecond) {
  EXPECT_EQ(parseTime("1700000010.012222").nanoseconds(), 1700000010012222000);
  EXPECT_EQ(parseTime("1700000010.123456789").nanoseconds(), 1700000010123456789);
  EXPECT_EQ(parseTime("1700000010.000000001").nanoseconds(), 1700000010000000001);
  EXPECT_EQ(parseTime("1700000010").nanoseconds(), 1700000010000000000);
  EXPECT_EQ(parseTime("+0.5").nanoseconds(), 500000000);
  EXPECT_EQ(parseTime(".25").nanoseconds(), 250000000);
  EXPECT_EQ(parseTime("-1.5").nanoseconds(), -1500000000);
}

TEST(ParseTime, IsTheInverseOfFormatTime) {
  EXPECT_EQ(formatTime(Time::fromNanoseconds(1700000010000000001)), "1700000010.000000001");
  for (const std::int64_t ns : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{-1500000000},
                                std::int64_t{9200000000123456789}, std::int64_t{-9200000000123456789}}) {
    EXPECT_EQ(parseTime(formatTime(Time::fromNanoseconds(ns))).nanoseconds(), ns);
  }
}

TEST(ParseTime, RoundsBeyondNanoseconds) {
  EXPECT_EQ(parseTime("1.0000000004").nanoseconds(), 1000000000);
  EXPECT_EQ(parseTime("1.0000000005").nanoseconds(), 1000000001);
  EXPECT_EQ(parseTime("1.9999999999").nanoseconds(), 2000000000);
}

TEST(ParseTime, ReadsExponentsAsNumpyWritesThem) {
  EXPECT_EQ(parseTime("1.700000010012222e+09").nanoseconds(), 1700000010012222000);
  EXPECT_EQ(parseTime("1.700000010012222051620483398e+09").nanoseconds(), 1700000010012222052);
  EXPECT_EQ(parseTime("25E-2").nanoseconds(), 250000000);
  EXPECT_EQ(parseTime("1e-20").nanoseconds(), 0);
}

TEST(ParseTime, RefusesWhatIsNoTime) {
  for (const char* text : {"", "-", ".", "abc", "1.5s", "1e", "1e5x", "1.2.3", "nan", "inf", "0x10", " 1",
                           "1700000010012222000", "1e300", "1e-99999999999999999999"}) {
    EXPECT_THROW(parseTime(text), std::invalid_argument) << "'" << text << "'";
  }
  EXPECT_THROW(parseTime(std::string("1e0\0x", 5)), std::invalid_argument) << "text after a zero byte";
}

// --- Files ---

Trajectory read(const std::string& text) {
  std::istringstream in(text);
  return readTum(in, "made_up.txt");
}

/// The message with which reading fails; empty if it does not.
std::string readFailure(const std::string& text) {
  try {
    read(text);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(Tum, ReadsPosesCommentsAndBlankLines) {
  const Trajectory trajectory = read(
      "# stamp x y z qx qy qz qw\n\n1700000000.000000001 1 2 3 0 0 0.6 0.8 \r\n   \n  # more\n"
      "1.7000000005e+09\t-1.5 0 2e-1 1 0 0 0");
  ASSERT_EQ(trajectory.size(), 2u);
  EXPECT_EQ(trajectory[0].time.nanoseconds(), 1700000000000000001);
  EXPECT_TRUE(trajectory[0].p_W.isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE(trajectory[0].q_WI.isApprox(Eigen::Quaterniond(0.8, 0, 0, 0.6)));
  EXPECT_EQ(trajectory[1].time.nanoseconds(), 1700000000500000000);
  EXPECT_TRUE(trajectory[1].p_W.isApprox(Eigen::Vector3d(-1.5, 0, 0.2)));
  EXPECT_TRUE(trajectory[1].q_WI.isApprox(Eigen::Quaterniond(0, 1, 0, 0)));
}

TEST(Tum, NormalisesRoundedQuaternions) {
  EXPECT_NEAR(read("1 0 0 0 0 0 0.71 0.70\n")[0].q_WI.norm(), 1.0, 1e-15);
}

TEST(Tum, NamesFileLineAndExpectation) {
  const std::string good = "# header\n1.0 0 0 0 0 0 0 1\n";
  const auto expectFailure = [&good](const std::string& line, const std::string& reason) {
    const std::string message = readFailure(good + line + "\n");
    EXPECT_TRUE(contains(message, "made_up.txt:3: ")) << message;
    EXPECT_TRUE(contains(message, reason)) << message;
    EXPECT_TRUE(contains(message, "expected")) << message;
  };
  expectFailure("2.0 0 0 0 0 0 1", "found 7 fields");
  expectFailure("2.0 0 0 0 0 0 0 1 5", "found 9 fields");
  expectFailure("2.0,0,0,0,0,0,0,1", "found 1 fields");
  expectFailure("2.0 0 zero 0 0 0 0 1", "'zero' is not a finite number");
  expectFailure("2.0 0 nan 0 0 0 0 1", "'nan' is not a finite number");
  expectFailure("2.0 0 0 0 0 0 0 inf", "'inf' is not a finite number");
  expectFailure("1700000010012222000 0 0 0 0 0 0 1", "is not a time in seconds");
  expectFailure("2.0 0 0 0 0 0 0 0", "norm 0.0");
  expectFailure("2.0 0 0 0 0 0 0 1.1", "norm 1.1");
  expectFailure("1.0 0 0 0 0 0 0 1", "increasing stamps");
  expectFailure("0.999999999 0 0 0 0 0 0 1", "increasing stamps");
}

TEST(Tum, MissingFileIsNamed) {
  try {
    readTum("no/such/file.txt");
    FAIL() << "no exception";
  } catch (const std::runtime_error& error) {
    EXPECT_TRUE(contains(error.what(), "no/such/file.txt")) << error.what();
  }
  try {
    readTum("/");
    FAIL() << "no exception";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "/: expected a trajectory file (TUM format), this is a folder");
  }
  EXPECT_THROW(writeTum("no/such/folder/file.txt", helix()), std::runtime_error);
}

TEST(Tum, AFullDiskLeavesWhatWasThere) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/trajectory.txt";
  writeTum(path, helix());
  {
    const FullDisk disk(100);
    EXPECT_THROW(writeTum(path, helix()), std::runtime_error);
  }
  EXPECT_EQ(readTum(path).size(), helix().size());
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

TEST(Tum, WritesWhatItReads) {
  Trajectory written = helix();
  written[0].time = Time::fromNanoseconds(-1500000000);
  written[1].time = Time::fromNanoseconds(-1);
  written[2].time = Time::fromNanoseconds(1234567890123456789);
  written.resize(3);
  std::string text;
  for (const StampedPose& p : written) appendTumLine(&text, p);
  const Trajectory back = read(text);
  ASSERT_EQ(back.size(), written.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back[i].time, written[i].time) << i;
    EXPECT_LT((back[i].p_W - written[i].p_W).norm(), 1e-9) << i;
    EXPECT_LT(back[i].q_WI.angularDistance(written[i].q_WI), 1e-8) << i;
  }
}

}  // namespace
}  // namespace rio_t
