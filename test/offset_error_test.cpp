// The error of the time offset: its file, its statistics, and its consistency.
#include "rio_t/evaluation/offset_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "evaluation_setup.h"

namespace rio_t {
namespace {

std::vector<OffsetSample> readOffsets(const std::string& text) {
  std::istringstream in(text);
  return readTimeOffsets(in, "offset.csv");
}

TEST(Offset, ReadsItsColumnsByName) {
  const std::vector<OffsetSample> samples =
      readOffsets("stamp,offset_s,sigma_s\n1700000000.123456789,-0.009,0.001\n\n1700000000.2,0.01,2e-3\r\n");
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(samples[0].time.nanoseconds(), 1700000000123456789);
  EXPECT_DOUBLE_EQ(samples[0].offset, -0.009);
  EXPECT_DOUBLE_EQ(samples[0].sigma, 0.001);
  EXPECT_DOUBLE_EQ(samples[1].offset, 0.01);
  const std::vector<OffsetSample> other =
      readOffsets("sigma_s, stamp, note, offset_s\n0.5, 3, hello, 0.25\n");
  ASSERT_EQ(other.size(), 1u);
  EXPECT_EQ(other[0].time, Time::fromSeconds(3));
  EXPECT_DOUBLE_EQ(other[0].offset, 0.25);
  EXPECT_DOUBLE_EQ(other[0].sigma, 0.5);
}

TEST(Offset, NamesFileLineAndExpectation) {
  const auto expectFailure = [](const std::string& text, const std::string& place,
                                const std::string& reason) {
    try {
      readOffsets(text);
      FAIL() << "accepted: " << text;
    } catch (const std::runtime_error& error) {
      EXPECT_TRUE(contains(error.what(), place)) << error.what();
      EXPECT_TRUE(contains(error.what(), reason)) << error.what();
    }
  };
  expectFailure("", "offset.csv:1: ", "no column 'stamp'");
  expectFailure("stamp,offset,sigma_s\n", "offset.csv:1: ", "no column 'offset_s'");
  expectFailure("stamp,offset_s,sigma_s\n1,2\n", "offset.csv:2: ", "found 2 columns");
  expectFailure("stamp,offset_s,sigma_s\n1,2,3\nx,2,3\n", "offset.csv:3: ", "'x' is not a time");
  expectFailure("stamp,offset_s,sigma_s\n1,,3\n", "offset.csv:2: ", "offset_s is ''");
  expectFailure("stamp,offset_s,sigma_s\n1,2,nan\n", "offset.csv:2: ", "sigma_s is 'nan'");
  expectFailure("stamp,offset_s,sigma_s\n1,2,-1\n", "offset.csv:2: ", "sigma_s is below zero");
}

TEST(Offset, ErrorsAndConsistencyOfAKnownSeries) {
  // Errors 0.5, -1.5, 2.5, -3.5 sigma of 1 ms about 10 ms.
  const std::vector<OffsetSample> samples = {
      {at(0), 0.0105, 0.001}, {at(1), 0.0085, 0.001}, {at(2), 0.0125, 0.001}, {at(3), 0.0065, 0.001}};
  const OffsetError error = offsetError(samples, 0.010);
  EXPECT_EQ(error.samples, 4u);
  EXPECT_NEAR(error.mean, -0.0005, 1e-12);
  EXPECT_NEAR(error.rmse, std::sqrt(5.25) * 1e-3, 1e-12);
  EXPECT_NEAR(error.max, 0.0035, 1e-12);
  EXPECT_NEAR(error.final_error, -0.0035, 1e-12);
  EXPECT_NEAR(error.final_sigma, 0.001, 1e-12);
  EXPECT_NEAR(error.share_1_sigma, 0.25, 1e-12);
  EXPECT_NEAR(error.share_2_sigma, 0.50, 1e-12);
  EXPECT_NEAR(error.share_3_sigma, 0.75, 1e-12);
  EXPECT_NEAR(error.mean_normalised_square, 5.25, 1e-9);
}

TEST(Offset, ConvergenceCanBeLeftOut) {
  const std::vector<OffsetSample> samples = {{at(0), 1.0, 0.1}, {at(1), 1.0, 0.1}, {at(2), 0.0, 0.1}};
  EXPECT_EQ(offsetError(samples, 0.0, 1.0).samples, 2u);
  EXPECT_EQ(offsetError(samples, 0.0, 1.5).rmse, 0.0);
  EXPECT_THROW(offsetError(samples, 0.0, 3.0), std::invalid_argument);
  EXPECT_THROW(offsetError({}, 0.0), std::invalid_argument);
  try {
    offsetError(samples, 0.0, 1e300);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "no time offset remains after the first 1e+300 s of 3 samples");
  }
}

/// The sigma of an offset that is not estimated is zero.
TEST(Offset, WithoutASigmaThereAreNoShares) {
  const OffsetError error = offsetError(readOffsets("stamp,offset_s,sigma_s\n1,0.05,0\n2,0.05,0\n"), 0.03);
  EXPECT_NEAR(error.rmse, 0.02, 1e-12);
  EXPECT_EQ(error.with_sigma, 0u);
  EXPECT_EQ(error.share_3_sigma, 0.0);
}

}  // namespace
}  // namespace rio_t
