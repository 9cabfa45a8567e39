// The combination of runs and the verdict of each axis, with numbers by hand.
#include "rio_t/odometry/calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

const AxisCalibration& axisOf(const RadarCalibration& calibration, CalibrationAxis axis) {
  return calibration.axes[static_cast<std::size_t>(axis)];
}

TEST(CombineOffset, ThePriorCountsOnce) {
  // Prior information 1, runs 5 and 10: 1 + 4 + 9 = 14. They say 2 and 3 of themselves, the prior 0.
  const OffsetEstimate prior{0.0, 1.0};
  const OffsetEstimate first{4.0 * 2.0 / 5.0, std::sqrt(1.0 / 5.0)};
  const OffsetEstimate second{9.0 * 3.0 / 10.0, std::sqrt(1.0 / 10.0)};
  const Combined<OffsetEstimate> combined = combine(prior, {first, second});
  EXPECT_TRUE(combined.agreement.agree());
  EXPECT_NEAR(combined.estimate.t_O, (4.0 * 2.0 + 9.0 * 3.0) / 14.0, 1e-12);
  EXPECT_NEAR(combined.estimate.sigma, std::sqrt(1.0 / 14.0), 1e-12);
}

TEST(CombineOffset, OneRunStaysAsItIs) {
  const Combined<OffsetEstimate> combined = combine({0.01, 0.075}, {{0.03, 0.002}});
  EXPECT_TRUE(combined.agreement.agree());
  EXPECT_NEAR(combined.estimate.t_O, 0.03, 1e-12);
  EXPECT_NEAR(combined.estimate.sigma, 0.002, 1e-12);
}

TEST(CombineOffset, RunsThatDifferGiveTheirMeanAndTheirScatter) {
  const Combined<OffsetEstimate> combined = combine({0.0, 0.075}, {{0.012, 0.001}, {0.045, 0.001}});
  EXPECT_FALSE(combined.agreement.agree());
  EXPECT_NEAR(combined.estimate.t_O, 0.0285, 1e-12);
  // Two numbers 33 ms apart scatter by 33 / sqrt(2); and each has its own sigma.
  EXPECT_NEAR(combined.estimate.sigma, std::sqrt(0.033 * 0.033 / 2.0 + 1e-6), 1e-12);
}

TEST(CombineOffset, TheLimitIsAt2Point6Sigma) {
  // The sigma of the difference is 1.414 ms; the prior hardly matters.
  const auto agree = [](double apart) {
    return combine({0.0, 1.0}, std::vector<OffsetEstimate>{{0.0, 0.001}, {apart, 0.001}}).agreement.agree();
  };
  EXPECT_TRUE(agree(2.55 * 0.001414));
  EXPECT_FALSE(agree(2.65 * 0.001414));
}

TEST(CombineOffset, ARunThatDidNotObserveItDoesNotDiffer) {
  const OffsetEstimate unobserved{0.0, 0.074};
  const Combined<OffsetEstimate> combined = combine({0.0, 0.075}, {{0.2, 0.001}, unobserved});
  EXPECT_TRUE(combined.agreement.agree());
  EXPECT_NEAR(combined.estimate.t_O, 0.2, 1e-4);
  EXPECT_FALSE(combine({0.0, 0.075}, {{0.2, 0.001}, unobserved, {0.1, 0.001}}).agreement.agree());
}

TEST(CombineOffset, ARunThatKnowsLessThanWasToldTakesNothingAway) {
  const Combined<OffsetEstimate> combined = combine({0.0, 0.075}, {{0.02, 0.001}, {0.1, 0.5}});
  EXPECT_NEAR(combined.estimate.t_O, 0.02, 1e-12);
  EXPECT_NEAR(combined.estimate.sigma, 0.001, 1e-12);
}

TEST(Agreement, ChiSquaredOfSeveralDegreesOfFreedom) {
  // 0.93 % lie above, from a table of chi-squared: 6.76 (1), 9.35 (2), 16.99 (6).
  EXPECT_TRUE((Agreement{6.6, 1}.agree()));
  EXPECT_FALSE((Agreement{6.9, 1}.agree()));
  EXPECT_TRUE((Agreement{9.2, 2}.agree()));
  EXPECT_FALSE((Agreement{9.5, 2}.agree()));
  EXPECT_TRUE((Agreement{16.8, 6}.agree()));
  EXPECT_FALSE((Agreement{17.2, 6}.agree()));
  EXPECT_DOUBLE_EQ((Agreement{16.8, 6}.widening()), 1.0);
  EXPECT_DOUBLE_EQ((Agreement{54.0, 6}.widening()), 3.0);
  EXPECT_TRUE((Agreement{0.0, 0}.agree()));
}

class CombineExtrinsics : public testing::Test {
 protected:
  static ExtrinsicsEstimate estimate(const Eigen::Vector3d& turn, const Eigen::Vector3d& l_I,
                                     const Eigen::VectorXd& sigmas) {
    return {{l_I, so3::exp(turn) * kConfigured}, sigmas.cwiseAbs2().asDiagonal()};
  }
  static Eigen::Vector3d turnOf(const ExtrinsicsEstimate& found) {
    return so3::log(found.T_IR.q_IR * kConfigured.conjugate());
  }
  static Eigen::VectorXd sigmas(double turn, double lever) {
    Eigen::VectorXd result(6);
    result << Eigen::Vector3d::Constant(turn), Eigen::Vector3d::Constant(lever);
    return result;
  }

  inline static const Eigen::Quaterniond kConfigured = so3::exp(Eigen::Vector3d(0.4, -1.2, 0.7));
  const ExtrinsicsEstimate prior_ =
      estimate(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), sigmas(0.17, 0.05));
};

TEST_F(CombineExtrinsics, OneRunStaysAsItIs) {
  ExtrinsicsEstimate run = estimate({0.05, -0.02, 0.08}, {0.1, 0.2, 0.3}, sigmas(0.01, 0.004));
  run.covariance(0, 4) = run.covariance(4, 0) = 2e-5;
  const Combined<ExtrinsicsEstimate> combined = combine(prior_, {run});
  EXPECT_LT(combined.estimate.T_IR.q_IR.angularDistance(run.T_IR.q_IR), 1e-12);
  EXPECT_TRUE(combined.estimate.T_IR.l_I.isApprox(run.T_IR.l_I, 1e-12));
  EXPECT_TRUE(combined.estimate.covariance.isApprox(run.covariance, 1e-9));
  EXPECT_EQ(combined.agreement.degrees_of_freedom, 0);
}

TEST_F(CombineExtrinsics, TwoRunsThatSayTheSameHaveSmallerSigmas) {
  const ExtrinsicsEstimate run = estimate({0.05, -0.02, 0.08}, {0.1, 0.2, 0.3}, sigmas(0.01, 0.004));
  const Combined<ExtrinsicsEstimate> combined = combine(prior_, {run, run});
  // 2 / 0.01^2 - 1 / 0.17^2 and 2 / 0.004^2 - 1 / 0.05^2
  EXPECT_NEAR(std::sqrt(combined.estimate.covariance(1, 1)), 1.0 / std::sqrt(20000.0 - 34.602), 1e-5);
  EXPECT_NEAR(std::sqrt(combined.estimate.covariance(5, 5)), 1.0 / std::sqrt(125000.0 - 400.0), 1e-8);
  // Without the pull of the prior, which each run has but the two have once, it lies a little farther out.
  EXPECT_NEAR(turnOf(combined.estimate).z(), 0.08 * 20000.0 / (20000.0 - 34.602), 2e-5);
  EXPECT_NEAR(combined.estimate.T_IR.l_I.z(), 0.3 * 125000.0 / (125000.0 - 400.0), 1e-9);
  EXPECT_EQ(combined.agreement.degrees_of_freedom, 6);
  EXPECT_NEAR(combined.agreement.chi_squared, 0.0, 1e-9);
}

TEST_F(CombineExtrinsics, ARunGivesWhatItObserved) {
  Eigen::VectorXd only_x = sigmas(0.17, 0.05), only_y = only_x;
  only_x[0] = 0.001;
  only_y[1] = 0.001;
  const Combined<ExtrinsicsEstimate> combined = combine(
      prior_,
      {estimate({0.006, 0.0, 0.0}, {0, 0, 0}, only_x), estimate({0.0, 0.003, 0.0}, {0, 0, 0}, only_y)});
  EXPECT_TRUE(turnOf(combined.estimate).isApprox(Eigen::Vector3d(0.006, 0.003, 0.0), 0.01));
  // The tangents at the two runs differ by half of their turn, which mixes in 3 mrad of what is not known.
  EXPECT_NEAR(std::sqrt(combined.estimate.covariance(0, 0)), 0.001, 2e-4);
  EXPECT_NEAR(std::sqrt(combined.estimate.covariance(1, 1)), 0.001, 2e-4);
  EXPECT_NEAR(std::sqrt(combined.estimate.covariance(2, 2)), 0.17, 0.002);
  EXPECT_EQ(combined.agreement.degrees_of_freedom, 0);
}

TEST_F(CombineExtrinsics, RunsThatDifferWidenTheSigmas) {
  const Combined<ExtrinsicsEstimate> combined =
      combine(prior_, {estimate({0.00, 0, 0}, {0, 0, 0}, sigmas(0.001, 0.05)),
                       estimate({0.02, 0, 0}, {0, 0, 0}, sigmas(0.001, 0.05))});
  // Each is 10 sigma from the mean in one direction of three: chi-squared 200.
  EXPECT_EQ(combined.agreement.degrees_of_freedom, 3);
  EXPECT_NEAR(combined.agreement.chi_squared, 200.0, 1.0);
  EXPECT_FALSE(combined.agreement.agree());
  EXPECT_NEAR(turnOf(combined.estimate).x(), 0.01, 1e-4);
  EXPECT_NEAR(std::sqrt(combined.estimate.covariance(0, 0)), std::sqrt(200.0 / 3.0) * 0.001 / std::sqrt(2.0),
              1e-4);
  // What was told is not worse for that.
  EXPECT_NEAR(std::sqrt(combined.estimate.covariance(3, 3)), 0.05, 1e-6);
}

TEST_F(CombineExtrinsics, ARotationAloneHasThreeNumbers) {
  const ExtrinsicsEstimate prior =
      estimate(Eigen::Vector3d::Zero(), {1, 2, 3}, Eigen::Vector3d::Constant(0.17));
  const ExtrinsicsEstimate run = estimate({0.05, 0.0, 0.0}, {1, 2, 3}, Eigen::Vector3d::Constant(0.01));
  const Combined<ExtrinsicsEstimate> combined = combine(prior, {run, run});
  EXPECT_EQ(combined.estimate.covariance.rows(), 3);
  EXPECT_EQ(combined.estimate.T_IR.l_I, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(combined.agreement.degrees_of_freedom, 3);
}

TEST_F(CombineExtrinsics, NothingToCombineIsRefused) {
  EXPECT_THROW(combine(prior_, std::vector<ExtrinsicsEstimate>{}), std::invalid_argument);
}

class Verdicts : public CombineExtrinsics {
 protected:
  const OffsetEstimate told_{0.0, 0.08};
};

TEST_F(Verdicts, HalfOfTheSigmaToldIsTheLimit) {
  Eigen::VectorXd found = sigmas(0.01, 0.01);
  found[1] = 0.0849;  // of 0.17
  found[2] = 0.0851;
  found[5] = 0.026;  // of 0.05
  const RadarCalibration calibration =
      calibrate(told_, prior_, {{0.03, 0.041}}, {estimate({0.02, 0.03, 0.04}, {0.01, 0.02, 0.03}, found)});
  const auto verdict = [&](CalibrationAxis axis) { return axisOf(calibration, axis).verdict; };
  EXPECT_EQ(verdict(CalibrationAxis::kOffset), Verdict::kNotObserved);
  EXPECT_EQ(verdict(CalibrationAxis::kTurnX), Verdict::kObserved);
  EXPECT_EQ(verdict(CalibrationAxis::kTurnY), Verdict::kObserved);
  EXPECT_EQ(verdict(CalibrationAxis::kTurnZ), Verdict::kNotObserved);
  EXPECT_EQ(verdict(CalibrationAxis::kLeverX), Verdict::kObserved);
  EXPECT_EQ(verdict(CalibrationAxis::kLeverZ), Verdict::kNotObserved);
  EXPECT_EQ(calibration.turnSigma(), 0.17);
  EXPECT_NEAR(axisOf(calibration, CalibrationAxis::kTurnZ).found, 0.04, 1e-9);
  EXPECT_NEAR(axisOf(calibration, CalibrationAxis::kTurnZ).sigma, 0.0851, 1e-9);

  // What is not observed stays as told.
  EXPECT_EQ(calibration.offset.t_O, 0.0);
  EXPECT_EQ(calibration.offset.sigma, 0.08);
  EXPECT_TRUE(calibration.T_IR.q_IR.isApprox(
      so3::exp({0.0, 0.0, -0.04}) * so3::exp({0.02, 0.03, 0.04}) * kConfigured, 1e-9));
  EXPECT_TRUE(calibration.T_IR.l_I.isApprox(Eigen::Vector3d(0.01, 0.02, 0.0), 1e-9));
}

TEST_F(Verdicts, NothingObservedIsAsToldToTheLastDigit) {
  const RadarCalibration calibration = calibrate(told_, prior_, {told_, told_}, {prior_, prior_});
  EXPECT_EQ(calibration.T_IR.q_IR.coeffs(), kConfigured.coeffs());
  for (const AxisCalibration& axis : calibration.axes) EXPECT_EQ(axis.verdict, Verdict::kNotObserved);
  EXPECT_NEAR(axisOf(calibration, CalibrationAxis::kLeverY).sigma, 0.05, 1e-9);
}

TEST_F(Verdicts, WhatIsNotEstimatedIsSaidSo) {
  const ExtrinsicsEstimate told =
      estimate(Eigen::Vector3d::Zero(), {1, 2, 3}, Eigen::Vector3d::Constant(0.17));
  const RadarCalibration calibration = calibrate(
      {0.02, 0.0}, told, {{0.02, 0.0}}, {estimate({0.1, 0, 0}, {1, 2, 3}, Eigen::Vector3d::Constant(0.01))});
  EXPECT_EQ(axisOf(calibration, CalibrationAxis::kOffset).verdict, Verdict::kNotEstimated);
  EXPECT_EQ(axisOf(calibration, CalibrationAxis::kLeverY).verdict, Verdict::kNotEstimated);
  EXPECT_EQ(axisOf(calibration, CalibrationAxis::kLeverY).found, 2.0);
  EXPECT_EQ(calibration.offset.t_O, 0.02);
  EXPECT_NEAR(calibration.turnSigma(), 0.01, 1e-9);
}

TEST_F(Verdicts, AnOffsetThatDiffersIsObservedAndSaidToDiffer) {
  const RadarCalibration calibration =
      calibrate(told_, prior_, {{-0.1, 0.001}, {0.1, 0.001}}, {prior_, prior_});
  EXPECT_FALSE(calibration.offset_agreement.agree());
  EXPECT_EQ(axisOf(calibration, CalibrationAxis::kOffset).verdict, Verdict::kObserved);
  EXPECT_NEAR(calibration.offset.sigma, 0.2 / std::sqrt(2.0), 1e-4);
}

TEST_F(Verdicts, WhatToMoveIsTheOtherAxes) {
  EXPECT_EQ(whatToMove(CalibrationAxis::kOffset), "change speed or turn quickly");
  EXPECT_EQ(whatToMove(CalibrationAxis::kTurnY), "change speed along x or z of the IMU");
  EXPECT_EQ(whatToMove(CalibrationAxis::kLeverZ), "rotate about x or y of the IMU");
}

}  // namespace
}  // namespace rio_t
