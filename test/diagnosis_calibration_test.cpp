// The causes of a wrong calibration: mounting, lever arm, scale of the Doppler, time offset, vehicle frame.
#include <gtest/gtest.h>

#include "good_run.h"
#include "rio_t/ros/diagnosis/diagnosis.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

TEST(DiagnosisOfCalibration, AMountingFarFromTheToldOneIsNoGoodRun) {
  RunEvidence evidence = goodRun();
  evidence.radars.front().turn = Eigen::Vector3d(0.1, 0.5, -0.45);  // the sigma is 0.17
  EXPECT_EQ(first(evidence), "none");
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kGood);
  evidence.radars.front().turn.y() = -1.5;
  expectSays(first(evidence),
             {"mounting_far: The estimated mounting is turned from the configured one by 6, -86, -26 degrees",
              "extrinsics_rotation_sigma 9.74 degrees", "Check radar_doppler_sign"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
}

TEST(DiagnosisOfCalibration, AMountingThatIsHeldAndContradictedIsNoGoodRun) {
  RunEvidence evidence = goodRun();
  const Eigen::Matrix3d covariance = 1e-4 * Eigen::Matrix3d::Identity();  // a sigma of 0.6 degrees
  evidence.radars.front().errors.turn = VectorError{Eigen::Vector3d(0.03, 0.03, 0.03), covariance};
  EXPECT_EQ(first(evidence), "none");
  evidence.radars.front().errors.turn->error.y() = -0.1;
  expectSays(first(evidence),
             {"mounting_far: The scans fit better if the mounting is turned by 2, -6, 2 degrees",
              "with sigmas of 0.6, 0.6, 0.6", "estimate_extrinsics: pose"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
  Config tf;
  tf.extrinsics_source = ExtrinsicsSource::kTf;
  EXPECT_NE(diagnose(evidence, tf).causes.front().remedy.find("correct the tf of the cloud"),
            std::string::npos);
  evidence.radars.front().errors.turn->covariance *= 100.0;  // noise explains it
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kGood);
}

TEST(DiagnosisOfCalibration, AWrongScaleOfTheDopplerIsNoGoodRun) {
  RunEvidence evidence = goodRun();
  evidence.radars.front().errors.scale = {-0.09, 1e-6};  // an accelerometer may be off, too
  EXPECT_EQ(first(evidence), "none");
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kGood);
  evidence.radars.front().errors.scale.error = -1.0;
  expectSays(first(evidence), {"doppler_scale: The Doppler seems to be about 0.5 times the velocity that the "
                               "IMU feels.",
                               "radar_format", "radar_field_doppler", "in m/s"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
  // It explains a mounting that seems turned a little, and an offset that comes to its bound.
  evidence.radars.front().errors.turn =
      VectorError{Eigen::Vector3d(0.0, 0.1, 0.0), 1e-4 * Eigen::Matrix3d::Identity()};
  evidence.solver_terminations = {{"at_bound", 60}, {"converged", 120}};
  expectSays(first(evidence), {"doppler_scale: "});
  evidence.radars.front().errors.scale = {-0.2, 0.0};
  evidence.radars.front().errors.turn->error.y() = 1.0;  // the better explanation
  expectSays(first(evidence), {"mounting_far: "});
  evidence = goodRun();
  evidence.radars.front().errors.scale = {0.5, 1e-4};
  expectSays(first(evidence), {"about 2 times the velocity that the IMU feels."});
  evidence.radars.front().errors.scale.variance = 0.1;  // noise explains it
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kGood);
}

TEST(DiagnosisOfCalibration, AWrongOffsetThatIsHeldIsNoGoodRun) {
  RunEvidence evidence = goodRun();
  evidence.radars.front().errors.offset = ScalarError{0.004, 1e-8};  // less than a scan notices
  EXPECT_EQ(first(evidence), "none");
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kGood);
  evidence.radars.front().errors.offset->error = 0.03;
  expectSays(first(evidence), {"offset_far: The scans fit better with a time offset of about 0.030 s",
                               "estimate_time_offset: false holds it at 0.000 s", "time_offset_initial"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
  evidence.radars.front().errors.offset->variance = 1e-4;  // noise explains it
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kGood);
}

TEST(DiagnosisOfCalibration, AWrongLeverArmThatIsHeldIsNoGoodRun) {
  RunEvidence evidence = goodRun();
  const Eigen::Matrix3d covariance = 1e-6 * Eigen::Matrix3d::Identity();
  evidence.radars.front().errors.lever_arm = VectorError{Eigen::Vector3d(0.02, 0.02, 0.02), covariance};
  EXPECT_EQ(first(evidence), "none");  // a tape measures no better
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kGood);
  evidence.radars.front().errors.lever_arm->error.z() = -0.2;
  expectSays(
      first(evidence),
      {"lever_arm_far: The scans fit better if the lever arm changes by 0.020, 0.020, -0.200 m along x, y, z",
       "with sigmas of 0.001, 0.001, 0.001", "estimate_extrinsics: pose", "extrinsics_translation"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
  evidence.radars.front().errors.lever_arm->covariance(2, 2) = 0.01;  // noise explains it
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kGood);
}

TEST(DiagnosisOfCalibration, TheOffsetAtItsBoundIsNamed) {
  RunEvidence evidence = goodRun();
  evidence.solver_terminations = {{"at_bound", 150}, {"converged", 30}};
  expectSays(first(evidence),
             {"offset_at_bound: 150 of 180 windows", "max_time_offset 0.25 s", "radar_stamp_shift"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
}

TEST(DiagnosisOfCalibration, AnOffsetBeyondItsBoundLooksLikeAWrongScale) {
  RunEvidence evidence = goodRun();
  evidence.radars.front().errors.scale = {-1.0, 1e-6};
  evidence.solver_terminations = {{"at_bound", 150}, {"converged", 30}};
  expectSays(first(evidence), {"offset_at_bound: "});
  evidence.solver_terminations = {{"at_bound", 110}, {"converged", 70}};
  expectSays(first(evidence), {"doppler_scale: "});
  EXPECT_EQ(diagnose(evidence, Config{}).causes.at(1).name, "offset_at_bound");
}

TEST(DiagnosisOfCalibration, AMountingThatDrivesTheOffsetToItsBoundIsNamedFirst) {
  RunEvidence evidence = goodRun();
  evidence.solver_terminations = {{"at_bound", 150}, {"converged", 30}};
  evidence.radars.front().turn = Eigen::Vector3d(0.1, -0.6, 0.0);
  expectSays(first(evidence), {"mounting_far: The estimated mounting is turned"});
  EXPECT_EQ(diagnose(evidence, Config{}).causes.at(1).name, "offset_at_bound");
}

TEST(DiagnosisOfCalibration, AnOffsetThatStepsAgainAndAgainIsDoubtful) {
  RunEvidence evidence = goodRun();
  evidence.input_faults["time_offset_step"] = 2;
  EXPECT_EQ(first(evidence), "none") << "one restart of the driver may count twice";
  evidence.input_faults["time_offset_step"] = 3;
  expectSays(first(evidence), {"offset_steps: The time offset stepped 3 times", "wrong mounting", "persons"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
  Config shared;
  shared.odometry.smoother.time_offset_shared = true;
  expectSays(first(evidence, shared), {"offset_steps", "time_offset_shared: true"});
}

TEST(DiagnosisOfCalibration, AVehicleFrameThatTurnsFarIsNamed) {
  Config config;
  config.odometry.platform = Platform::kGroundVehicle;
  config.odometry.ground_vehicle.T_IV.q_IR = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
  EvidenceCollector collector(config);
  ScanResult result;
  result.used = true;
  result.ground_vehicle.emplace();
  const auto turnedBy = [&](double angle) {
    result.ground_vehicle->q_IV =
        Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * config.odometry.ground_vehicle.T_IV.q_IR;
    collector.add(result);
    RunEvidence evidence = goodRun();
    evidence.ground_vehicle = collector.groundVehicle();
    return evidence;
  };
  const double sigma = config.odometry.ground_vehicle.rotation_sigma;
  EXPECT_EQ(first(turnedBy(2.9 * sigma), config), "none");
  const RunEvidence far = turnedBy(6.0 * sigma);
  expectSays(first(far, config),
             {"vehicle_frame_far", "6 vehicle_frame_rotation_sigma", "vehicle_frame_rotation_xyzw"});
  EXPECT_EQ(diagnose(far, config).verdict, RunVerdict::kDoubtful);
}

}  // namespace
}  // namespace rio_t
