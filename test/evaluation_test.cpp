// The errors of whole files against known figures, and against those of evo.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <string>

#include "evaluation_setup.h"
#include "rio_t/evaluation/errors.h"
#include "rio_t/evaluation/trajectory.h"

namespace rio_t {
namespace {

struct Figures {
  double rmse, mean, max;
};

void expectFigures(const Statistics& s, const Figures& expected) {
  const double last_digit = 0.51e-6;  // the figures have six decimals
  EXPECT_NEAR(s.rmse, expected.rmse, last_digit);
  EXPECT_NEAR(s.mean, expected.mean, last_digit);
  EXPECT_NEAR(s.max, expected.max, last_digit);
}

// Figures from a plain transcription of evo's definitions in numpy (a full search for each pose, 4x4
// matrices), which also gives evo's own figures of the next test.
TEST(Figures, OfCommittedFiles) {
  const Trajectory truth = readTum(testData("evaluation_truth.txt"));
  const Trajectory estimate = readTum(testData("evaluation_estimate.txt"));
  ASSERT_EQ(truth.size(), 241u);
  ASSERT_EQ(estimate.size(), 584u);

  const AbsoluteError origin = absoluteError(truth, estimate, Alignment::kOrigin);
  EXPECT_EQ(origin.matched_poses, 225u);
  expectFigures(origin.translation_m, {0.025482, 0.023364, 0.045156});
  expectFigures(origin.rotation_deg, {1.077698, 1.005587, 1.730499});
  EXPECT_NEAR(origin.translation_m.median, 0.023298, 0.51e-6);
  EXPECT_NEAR(origin.rotation_deg.median, 1.126887, 0.51e-6);

  const AbsoluteError se3 = absoluteError(truth, estimate, Alignment::kSe3);
  expectFigures(se3.translation_m, {0.014667, 0.013245, 0.037848});
  expectFigures(se3.rotation_deg, {1.254032, 1.159801, 1.962038});

  const AbsoluteError yaw = absoluteError(truth, estimate, Alignment::kYaw);
  expectFigures(yaw.translation_m, {0.015262, 0.013604, 0.038771});
  expectFigures(yaw.rotation_deg, {1.249925, 1.168783, 1.973520});

  const RelativeError metre = relativeError(truth, estimate);
  EXPECT_EQ(metre.pairs, 10u);
  expectFigures(metre.translation_m, {0.028438, 0.026558, 0.041871});
  expectFigures(metre.rotation_deg, {0.814888, 0.757051, 1.428162});

  RelativeErrorOptions options;
  options.all_pairs = true;
  const RelativeError all = relativeError(truth, estimate, options);
  EXPECT_EQ(all.pairs, 209u);
  expectFigures(all.translation_m, {0.025786, 0.024129, 0.048635});
  expectFigures(all.rotation_deg, {0.796188, 0.746614, 1.468487});

  // A tighter limit leaves out truth that falls between the estimate's poses, here most of it.
  EXPECT_EQ(absoluteError(truth, estimate, Alignment::kOrigin, 0.003).matched_poses, 72u);
  EXPECT_NEAR(absoluteError(truth, estimate, Alignment::kOrigin, 0.003).translation_m.rmse, 0.024587,
              0.51e-6);
}

struct EvoFigures {
  std::string name, truth, estimate;
  std::size_t matched;
  Figures origin_m, origin_deg, se3_m, se3_deg;
  double metre_m, metre_deg;
  std::size_t pairs;
  double all_m, all_deg;
  std::size_t all_pairs;
};

/// Figures that evo itself computed on files too large to commit.
const EvoFigures kEvo[] = {
    {"ekf_rio_mocap_easy_m9",
     "/sim/mocap_easy_m9.gt.txt",
     "/eval/ekf_rio_mocap_easy_m9.txt",
     8115,
     {0.058367, 0.055260, 0.084367},
     {0.363612, 0.342779, 0.724655},
     {0.040816, 0.038705, 0.069779},
     {0.329626, 0.319907, 0.550763},
     0.013503,
     0.128804,
     53,
     0.013889,
     0.119935,
     5405},
    {"authors_mocap_medium_p30",
     "/sim/mocap_medium_p30.gt.txt",
     "/eval/authors_mocap_medium_p30.txt",
     8367,
     {0.298575, 0.258098, 0.483595},
     {0.729313, 0.684299, 2.606080},
     {0.172319, 0.156688, 0.326971},
     {1.319287, 1.293084, 2.756566},
     0.054291,
     0.547607,
     65,
     0.044769,
     0.559674,
     7078},
};

class EvoComparison : public testing::TestWithParam<EvoFigures> {};

TEST_P(EvoComparison, GivesTheSameFigures) {
  const EvoFigures& evo = GetParam();
  const char* folder = std::getenv("RIO_T_DATA_DIR");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  const std::string data = folder != nullptr ? folder : std::string(RIO_T_SOURCE_DIR) + "/../shared/data";
  for (const std::string& file : {data + evo.truth, data + evo.estimate}) {
    if (!std::ifstream(file)) GTEST_SKIP() << file << " is absent (folder: RIO_T_DATA_DIR)";
  }
  const Trajectory truth = readTum(data + evo.truth);
  const Trajectory estimate = readTum(data + evo.estimate);
  const double max_difference = 0.002;

  const AbsoluteError origin = absoluteError(truth, estimate, Alignment::kOrigin, max_difference);
  EXPECT_EQ(origin.matched_poses, evo.matched);
  expectFigures(origin.translation_m, evo.origin_m);
  expectFigures(origin.rotation_deg, evo.origin_deg);
  const AbsoluteError se3 = absoluteError(truth, estimate, Alignment::kSe3, max_difference);
  expectFigures(se3.translation_m, evo.se3_m);
  expectFigures(se3.rotation_deg, evo.se3_deg);

  RelativeErrorOptions options;
  const RelativeError metre = relativeError(truth, estimate, options, max_difference);
  EXPECT_EQ(metre.pairs, evo.pairs);
  EXPECT_NEAR(metre.translation_m.rmse, evo.metre_m, 0.51e-6);
  EXPECT_NEAR(metre.rotation_deg.rmse, evo.metre_deg, 0.51e-6);
  options.all_pairs = true;
  const RelativeError all = relativeError(truth, estimate, options, max_difference);
  EXPECT_EQ(all.pairs, evo.all_pairs);
  EXPECT_NEAR(all.translation_m.rmse, evo.all_m, 0.51e-6);
  EXPECT_NEAR(all.rotation_deg.rmse, evo.all_deg, 0.51e-6);
}

INSTANTIATE_TEST_SUITE_P(Figures, EvoComparison, testing::ValuesIn(kEvo),
                         [](const testing::TestParamInfo<EvoFigures>& evo) { return evo.param.name; });

}  // namespace
}  // namespace rio_t
