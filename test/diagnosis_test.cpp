// Each cause from the counters that show it. test/diagnosis_test.py has the runs that show them.
#include "rio_t/ros/diagnosis/diagnosis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "good_run.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

/// Nothing was used after the start.
RunEvidence withRejected(const std::string& reason) {
  RunEvidence evidence = goodRun();
  evidence.radars.front().scans_used = 0;
  evidence.radars.front().velocity_status = {{"moving", 10}};
  evidence.radars.front().scans_rejected = {{reason, 190}};
  return evidence;
}

RunEvidence neverStarted(StartObstacle obstacle, const std::string& text) {
  RunEvidence evidence = goodRun();
  evidence.initialized = false;
  evidence.waiting_for = {obstacle, text};
  evidence.scans_judged = 0;
  evidence.solver_terminations.clear();
  RadarSummary& radar = evidence.radars.front();
  radar.scans_used = 0;
  radar.scans_before_start = radar.scans_total;
  radar.scans_rejected.clear();
  radar.velocity_status = {{"moving", 200}};
  return evidence;
}

TEST(Diagnosis, AGoodRunHasNoCauses) {
  const Diagnosis diagnosis = diagnose(goodRun(), Config{});
  EXPECT_EQ(toString(diagnosis.verdict), "good");
  EXPECT_EQ(describeCauses(diagnosis), "");
  EXPECT_EQ(diagnosis.checks.size(), 14u);
  for (const Check& check : diagnosis.checks) EXPECT_TRUE(check.good()) << check.name;
}

TEST(Diagnosis, TooFewPointsNameThoseThatAreNotFinite) {
  RunEvidence evidence = withRejected("too_few_points");
  EXPECT_EQ(first(evidence).find("not finite"), std::string::npos);
  evidence.radars.front().points_not_finite = 21;
  expectSays(first(evidence),
             {"too_few_points", "Look at the driver of the radar: 21 more points are not finite"});
}

TEST(Diagnosis, CloudsOfNothingButPaddingHaveOtherFields) {
  RunEvidence evidence = withRejected("too_few_points");
  evidence.radars.front().points = 0;
  evidence.radars.front().padding = 6400;
  expectSays(first(evidence), {"All 6400 points are at range zero, or NaN", "radar_field_x"});
}

TEST(Diagnosis, TooFewPointsSayWhetherTheCloudsAreEmptyOrWhichKeyTookThem) {
  RunEvidence evidence = withRejected("too_few_points");
  RadarSummary& radar = evidence.radars.front();
  expectSays(first(evidence), {"too_few_points: 190 of 200 scans have too few points for a velocity: 35 on "
                               "average after the filter. Set a lower detection threshold"});
  radar.scans_empty = 120;
  radar.scans_emptied[static_cast<std::size_t>(PointVerdict::kBesideView)] = 70;
  expectSays(
      first(evidence),
      {"190 of 200 scans have too few points for a velocity: 120 clouds are empty, 70 lost their points "
       "to radar_max_azimuth 1.57 rad, the other 10 have 700 on average after the filter. Look for what "
       "empties the clouds in the driver of the radar"});
  radar.scans_empty = 0;
  radar.scans_emptied[static_cast<std::size_t>(PointVerdict::kBesideView)] = 190;
  expectSays(first(evidence), {": 190 lost their points to radar_max_azimuth 1.57 rad, the other 10 have",
                               "Change radar_max_azimuth if"});
  radar.scans_emptied = {};
  radar.scans_empty = 200;
  radar.points = 0;
  expectSays(first(evidence), {": 200 clouds are empty. Look for"});
}

TEST(Diagnosis, FilteredPointsNameTheFilterAndTheUnit) {
  RunEvidence evidence = withRejected("too_few_points");
  pointsOf(evidence, PointVerdict::kKept) = 0;
  pointsOf(evidence, PointVerdict::kTooNear) = 0;
  pointsOf(evidence, PointVerdict::kTooWeak) = 10000;
  evidence.radars.front().snr_sum_db = 15000.0;
  Config config;
  config.radar_overrides.power_unit = PowerUnit::kSnrDeciDb;
  expectSays(
      first(evidence, config),
      {"points_too_weak: 10000 of 10000 points are below radar_min_snr_db 3 dB", "their mean is 1.5 dB",
       "and radar_power_unit reads the power as snr_decidb", "Set radar_power_unit"});
  // One cause: that there are too few points follows from it.
  EXPECT_EQ(diagnose(evidence, config).causes.size(), 1u);
  EXPECT_EQ(diagnose(evidence, config).verdict, RunVerdict::kBad);
}

/// Such scans say "at rest", which the IMU contradicts little while the step of the Doppler is not known.
TEST(Diagnosis, ADopplerFieldOfZerosIsNamedOnceThePlatformMoves) {
  RunEvidence evidence = goodRun();
  RadarSummary& radar = evidence.radars.front();
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kGood) << "it stands still";
  radar.scans_fast = 100;
  expectSays(first(evidence),
             {"doppler_zero: All 10000 points have a Doppler of zero, and the platform moved "
              "at more than 0.5 m/s for 100 scans.",
              "Check radar_field_doppler"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
  radar.points_with_doppler = 1;
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kGood);
}

TEST(Diagnosis, AStepThatTheDopplersDoNotHaveIsNamed) {
  RunEvidence evidence = goodRun();
  RadarKnowledge& knowledge = evidence.radars.front().knowledge;
  knowledge.read_doppler_step = {0.125, DopplerSource::kData};
  const auto verdict = [&](double given) {
    knowledge.doppler_step = {given, DopplerSource::kGiven};
    return diagnose(evidence, Config{}).verdict;
  };
  for (const double fits : {0.0, 0.03, 0.125, 0.13}) EXPECT_EQ(verdict(fits), RunVerdict::kGood) << fits;
  EXPECT_EQ(verdict(0.25), RunVerdict::kDoubtful);
  expectSays(first(evidence), {"doppler_step_far: The Dopplers are multiples of 0.125 m/s, and "
                               "radar_doppler_step says 0.25 m/s.",
                               "Set radar_doppler_step: 0"});
  knowledge.read_doppler_step = {0.0, DopplerSource::kData};  // it may be the resolution
  EXPECT_EQ(verdict(0.25), RunVerdict::kGood);
}

TEST(Diagnosis, EachFilterHasItsKey) {
  const std::pair<PointVerdict, std::string> filters[] = {
      {PointVerdict::kTooNear, "radar_min_range"},
      {PointVerdict::kTooFar, "radar_max_range"},
      {PointVerdict::kBesideView, "radar_axes"},
      {PointVerdict::kAboveView, "radar_axes"},
      {PointVerdict::kNoMeasurement, "radar_field_doppler"},
      {PointVerdict::kAmbiguous, "multiObjBeamForming"},
  };
  for (const auto& [verdict, key] : filters) {
    RunEvidence evidence = goodRun();
    evidence.radars.front().points_by_verdict = {};
    pointsOf(evidence, verdict) = 9000;
    pointsOf(evidence, PointVerdict::kKept) = 1000;
    expectSays(first(evidence), {"9000 of 10000 points", key});
    EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful) << "it runs, with few points";
  }
}

TEST(Diagnosis, RejectedScansNameReasonAndKey) {
  const std::pair<std::string, std::string> reasons[] = {
      {"stamp_zero", "stamp_source"},
      {"stamp_out_of_range", "radar_stamp_shift"},
      {"stamp_ahead_of_imu", "stamp_source: arrival"},
      {"older_than_window", "radar_stamp_shift"},
      {"imu_not_covering", "radar_stamp_shift"},
      {"trigger_missing", "trigger_topic"},
      {"duplicate_stamp", "stamp_source: arrival"},
      {"scan_repeated", "only if it has measured"},
      {"queue_full", "window"},
      {"cloud_not_usable", "radar_format"},
      {"too_few_points", "detection threshold"},
      {"too_few_inliers", "radar_field_doppler"},
      {"ill_conditioned", "radar_max_azimuth"},
      {"sigma_too_large", "ego_velocity_max_sigma"},
      {"innovation", "extrinsics_rotation_xyzw"},
  };
  for (const auto& [reason, key] : reasons) {
    const RunEvidence evidence = withRejected(reason);
    expectSays(first(evidence), {"190 of ", key});
    EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kBad) << reason;
  }
}

TEST(Diagnosis, AStartThatNeverCameSaysWhatItWaitsFor) {
  expectSays(first(neverStarted(StartObstacle::kContradiction, "together they show 3 m/s^2 as gravity")),
             {"start_contradicts", "together they show 3 m/s^2", "radar_doppler_sign"});
  expectSays(first(neverStarted(StartObstacle::kWrongGravity, "mean accelerometer 1.00 m/s^2")),
             {"imu_units", "1.00 m/s^2", "may publish g"});
  const RunEvidence short_rest = neverStarted(StartObstacle::kTooFewData, "1.2 of 3.0 s seen");
  expectSays(first(short_rest), {"too_short", "1.2 of 3.0 s", "init_duration"});
  EXPECT_EQ(diagnose(short_rest, Config{}).verdict, RunVerdict::kBad);
  Config config;
  config.odometry.init_mode = InitMode::kStatic;
  expectSays(first(neverStarted(StartObstacle::kMotion, "the gyro moves by 1 rad/s"), config),
             {"never_at_rest", "init_mode: auto"});
}

TEST(Diagnosis, AStartWithoutVelocitiesNamesTheirReason) {
  RunEvidence evidence =
      neverStarted(StartObstacle::kMotion, "radar velocities in motion: 0.0 of 2.5 s seen");
  evidence.radars.front().velocity_status = {{"too_few_inliers", 180}, {"moving", 20}};
  expectSays(first(evidence), {"too_few_inliers: 180 of 200 scans"});
}

TEST(Diagnosis, AClockOfTheRadarThatIsBehindIsNamed) {
  const Config config;
  EvidenceCollector collector(config);
  ScanResult result;
  result.rejected_because = "before_initialization";
  result.ego_velocity.status = EgoVelocityStatus::kMoving;
  result.scan.stamp = Time::fromSeconds(10.0);
  collector.add(result);  // before there is an IMU
  collector.addImu(Time::fromSeconds(100.0));
  collector.addImu(Time::fromSeconds(100.1));
  result.scan.stamp = Time::fromSeconds(100.05);
  collector.add(result);
  collector.addState(Time::fromSeconds(103.0));
  // As the odometry leaves a scan that it does not evaluate.
  result.ego_velocity = EgoVelocity();
  for (int k = 0; k < 98; ++k) {
    result.scan.stamp = Time::fromSeconds(11.5 + 0.1 * k);
    collector.add(result);
  }
  const RadarInertialOdometry odometry(config.odometry);
  RunEvidence evidence = collector.evidence(odometry, std::nullopt);
  EXPECT_EQ(evidence.radars[0].velocity_status, (Counts{{"moving", 2}, {"not_estimated", 98}}));
  evidence.initialized = true;
  EXPECT_EQ(diagnose(evidence, config).verdict, RunVerdict::kBad);
  ASSERT_EQ(diagnose(evidence, config).causes.size(), 1u);
  expectSays(first(evidence), {"stamp_before_imu: 98 of 100 scans are stamped before the first IMU sample, "
                               "the first of them by 88.5 s",
                               "stamp_source: arrival", "radar_stamp_shift"});
}

/// The IMU counts seconds from the boot of its computer, and the radar those of the calendar.
TEST(Diagnosis, AClockOfTheRadarThatIsAheadIsNamedAlsoForTheScansBeforeTheStart) {
  const Config config;
  EvidenceCollector collector(config);
  collector.addImu(Time::fromSeconds(100.0));
  ScanResult result;
  result.scan.stamp = Time::fromSeconds(1.7e9);
  result.rejected_because = "before_initialization";
  for (int k = 0; k < 30; ++k) collector.add(result);
  collector.addState(Time::fromSeconds(103.0));
  result.rejected_because = "stamp_ahead_of_imu";
  for (int k = 0; k < 10; ++k) collector.add(result);
  const RadarInertialOdometry odometry(config.odometry);
  RunEvidence evidence = collector.evidence(odometry, std::nullopt);
  evidence.initialized = true;
  ASSERT_EQ(diagnose(evidence, config).causes.size(), 1u);
  expectSays(first(evidence),
             {"stamp_ahead_of_imu: 40 of 40 scans are stamped ahead of the newest IMU sample, "
              "by up to 1699999900.0 s",
              "stamp_source: arrival"});
}

TEST(Diagnosis, ABatchThatDidNotConvergeIsDoubtful) {
  RunEvidence evidence = goodRun();
  Config config;
  config.mode = RunMode::kBatch;
  evidence.solver_terminations = {{"converged", 1}};
  EXPECT_EQ(diagnose(evidence, config).verdict, RunVerdict::kGood);
  evidence.solver_terminations = {{"iteration_limit", 1}};
  expectSays(first(evidence, config), {"not_converged", "batch_max_iterations 100"});
  EXPECT_EQ(diagnose(evidence, config).verdict, RunVerdict::kDoubtful);
}

TEST(Diagnosis, PointsThatAreNotFiniteAreLost) {
  RunEvidence evidence = goodRun();
  evidence.radars.front().points_not_finite = 4 * evidence.radars.front().points;
  expectSays(first(evidence), {"points_not_finite", "radar_field_"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
}

TEST(Diagnosis, ADivergenceIsBadIfItLastsAndDoubtfulIfNot) {
  RunEvidence evidence = goodRun();
  evidence.divergences = 1;
  evidence.scans_diverged = evidence.scans_contradicted = 30;
  expectSays(first(evidence), {"diverged once, for 30 of 190 scans", "radar_doppler_sign"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
  evidence.scans_diverged = 100;
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kBad);
  evidence.scans_diverged = 1;
  evidence.health = Health::kDiverged;
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kBad);
  // Others explain more, but this is why the run is bad.
  RadarSummary& radar = evidence.radars.front();
  radar.errors.scale = {-1.0, 1e-6};
  radar.errors.turn = VectorError{Eigen::Vector3d(0.0, 1.0, 0.0), 1e-4 * Eigen::Matrix3d::Identity()};
  evidence.solver_terminations = {{"at_bound", 110}, {"converged", 70}};
  const std::vector<Cause> causes = diagnose(evidence, Config{}).causes;
  ASSERT_EQ(causes.size(), 3U);
  EXPECT_EQ(causes.back().name, "diverged");
}

TEST(Diagnosis, AContradictionNamesCheckBagAndAMountingThatIsNotGiven) {
  const RunEvidence evidence = withRejected("innovation");
  expectSays(first(evidence), {"contradicts_imu", "order x, y, z, w", "rosrun rio_t check_bag BAG"});
  const Config config = makeConfig({});
  expectSays(first(evidence, config), {"no_mounting", "look along y of the IMU", "check_bag"});
  EXPECT_EQ(diagnose(evidence, config).causes.at(1).name, "contradicts_imu");
  EXPECT_TRUE(diagnose(goodRun(), config).causes.empty());
}

TEST(Diagnosis, ADivergenceAfterTheLastScanIsNoContradictionOfTheRadar) {
  RunEvidence evidence = goodRun();
  evidence.divergences = 1;
  evidence.health = Health::kDiverged;
  expectSays(first(evidence), {"no_scans: The estimate diverged once while no scan came"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kBad);
}

TEST(Diagnosis, ARadarThatIsSilentForMostOfTheTimeIsBad) {
  RunEvidence evidence = goodRun();
  evidence.run_seconds = 60.0;
  evidence.silent_seconds = 30.0;
  evidence.silence_begin = 29.0;
  evidence.silence_end = 60.0;
  EXPECT_EQ(first(evidence), "none") << "half of the time is not most of it";
  evidence.silent_seconds = 40.0;
  evidence.silence_begin = 19.04;
  evidence.health = Health::kDiverged;  // for lack of scans: not a cause
  const Diagnosis diagnosis = diagnose(evidence, Config{});
  EXPECT_EQ(diagnosis.verdict, RunVerdict::kBad);
  ASSERT_EQ(diagnosis.causes.size(), 1u);
  expectSays(first(evidence), {"radar_silent: No scan was used from 19.0 to 60.0 s after the start",
                               "for 40.0 of 60.0 s", "bag_start"});
  evidence.health = Health::kOk;  // the radar came back
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kBad);
  RunEvidence rejected = withRejected("innovation");
  rejected.run_seconds = 60.0;
  rejected.silent_seconds = 59.0;
  ASSERT_EQ(diagnose(rejected, Config{}).causes.size(), 1u) << "the radar was heard";
  EXPECT_EQ(diagnose(rejected, Config{}).causes[0].name, "contradicts_imu");
}

TEST(Diagnosis, ASilentRadarBesideAnotherIsNamed) {
  const Config config =
      makeConfig({parseAssignment("radars=[left, right]"), parseAssignment("left/radar_topic=/left"),
                  parseAssignment("right/radar_topic=/right")});
  EvidenceCollector collector(config);
  for (int k = 0; k <= 200; ++k) {
    const Time time = Time::fromSeconds(100.0 + 0.1 * k);
    collector.addState(time);
    ScanResult result;
    result.scan.stamp = time;
    result.used = true;
    collector.add(result);
    result.scan.radar = 1;
    if (k < 50) collector.add(result);
  }
  RunEvidence evidence = collector.evidence(RadarInertialOdometry(config.odometry), std::nullopt);
  EXPECT_EQ(evidence.silent_seconds, 0.0);
  EXPECT_NEAR(evidence.radars[1].silent_seconds, 14.0, 0.2);
  evidence.initialized = true;
  expectSays(first(evidence, config), {"radar_silent: No scan of radar right was used for 14.", "of 20.0 s"});
  EXPECT_EQ(diagnose(evidence, config).verdict, RunVerdict::kDoubtful);
}

TEST(Diagnosis, AMotionThatIsNotAVehiclesMakesARunDoubtful) {
  Config config;
  config.odometry.platform = Platform::kGroundVehicle;
  EvidenceCollector collector(config);
  ScanResult result;
  result.used = true;
  result.ground_vehicle.emplace().is_contradicted = true;
  collector.add(result);
  result.ground_vehicle->is_contradicted = false;  // the estimate started again
  collector.add(result);
  RunEvidence evidence = goodRun();
  evidence.ground_vehicle = collector.groundVehicle();
  expectSays(first(evidence, config), {"vehicle_contradicted", "platform: free"});
  EXPECT_EQ(diagnose(evidence, config).verdict, RunVerdict::kDoubtful);
}

TEST(Diagnosis, ADivergenceForLackOfScansNamesTheLack) {
  RunEvidence evidence = withRejected("stamp_ahead_of_imu");
  evidence.divergences = 1;
  evidence.scans_diverged = 100;
  const Diagnosis diagnosis = diagnose(evidence, Config{});
  ASSERT_EQ(diagnosis.causes.size(), 1u);
  EXPECT_EQ(diagnosis.causes[0].name, "stamp_ahead_of_imu");
}

TEST(Diagnosis, TheImuIsNamed) {
  RunEvidence evidence = goodRun();
  evidence.imu_noise.accel_density = 0.2;
  expectSays(first(evidence), {"imu_noisy", "accelerometer", "0.2 against imu_accel_noise_density 0.02"});
  EXPECT_EQ(first(evidence).find("gyro"), std::string::npos) << "it is as configured";
  evidence = goodRun();
  evidence.imu_noise.gyro_density = 0.004;
  expectSays(first(evidence), {"imu_noisy", "gyro", "0.004 against imu_gyro_noise_density 0.0002"});
  EXPECT_EQ(first(evidence).find("accel"), std::string::npos) << "it is as configured";
  evidence = goodRun();
  evidence.input_faults["imu_saturated"] = 400;
  expectSays(first(evidence), {"imu_saturated: 400 IMU samples", "imu_accel_range"});
  evidence = goodRun();
  evidence.input_faults["imu_gap"] = 100;
  expectSays(first(evidence), {"imu_gap: 100 gaps", "max_imu_gap"});
  const std::pair<std::string, std::string> more[] = {{"imu_not_finite", "NaN"},
                                                      {"imu_not_plausible", "imu_accel_range"},
                                                      {"imu_stamp_jump", "imu_jump_patience"},
                                                      {"imu_repeated", "read a new one"},
                                                      {"imu_stuck", "one of its axes"}};
  for (const auto& [name, part] : more) {
    evidence = goodRun();
    evidence.input_faults[name] = 400;
    expectSays(first(evidence), {name + ": 400 IMU samples", part});
  }
}

TEST(Diagnosis, BurstsOfStampsAreNoLoss) {
  RunEvidence evidence = goodRun();
  evidence.input_faults["imu_gap"] = 1226;
  evidence.imu_count = evidence.imu_steps = 24520;
  evidence.imu_gaps = 1226;
  evidence.imu_seconds = 60.0;
  evidence.imu_gap_seconds = 58.8;
  expectSays(first(evidence),
             {"imu_bursts: The stamps of the IMU come in bursts of 20, one burst each 0.0489 s",
              "no sample is lost", "let it give each sample the time"});
  // As many gaps, with half of the time between them.
  evidence.imu_gap_seconds = 30.0;
  expectSays(first(evidence), {"imu_gap: 1226 gaps", "look for what loses its messages"});
  // A slow IMU: each step is a gap.
  evidence.imu_steps = evidence.imu_gaps;
  evidence.imu_gap_seconds = evidence.imu_seconds;
  expectSays(first(evidence), {"imu_gap: 1226 gaps", "Raise max_imu_gap for a slow IMU"});
}

TEST(Diagnosis, AStartAfterMostOfTheScansIsNamed) {
  RunEvidence evidence = goodRun();
  evidence.radars.front().scans_before_start = 199;
  evidence.radars.front().scans_used = 1;
  evidence.radars.front().scans_rejected.clear();
  expectSays(first(evidence), {"started_late: 100 % of the scans", "init_duration"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
  Config config;
  config.odometry.init_mode = InitMode::kStatic;
  expectSays(first(evidence, config), {"set init_mode: auto"});
}

TEST(Diagnosis, AVelocityThatWasLostIsNoContradiction) {
  RunEvidence evidence = goodRun();
  evidence.divergences = 1;
  evidence.scans_diverged = 5;
  expectSays(first(evidence), {"velocity_lost: The velocity was lost once, for 5 of 190 scans", "imu_gap"});
  evidence.scans_contradicted = 5;
  EXPECT_EQ(first(evidence), "none") << "as near a person, briefly";
  evidence.reinitializations = 1;
  expectSays(first(evidence), {"diverged: The estimate diverged once", "contradict each other"});
}

TEST(Diagnosis, TheMountingOfASparseRadarIsToBeMeasured) {
  RunEvidence evidence = withRejected("innovation");
  expectSays(first(evidence), {"contradicts_imu", "Run `rosrun rio_t check_bag BAG`"});
  evidence.radars.front().points_per_scan = {4, 6, 9};
  expectSays(first(evidence), {"contradicts_imu", "Measure the mounting"});
}

TEST(Diagnosis, AVagueHeadingAfterAStartInMotionIsDoubtful) {
  RunEvidence evidence = goodRun();
  evidence.initialized_from = InitializedFrom::kMotion;
  EXPECT_EQ(first(evidence), "none");
  evidence.heading_sigma = 0.6;
  expectSays(first(evidence), {"heading_vague", "0.6 rad", "init_duration", "init_motion_sigma_gyro_bias"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
  evidence.initialized_from = InitializedFrom::kRest;  // a long way
  EXPECT_EQ(first(evidence), "none");
}

TEST(Diagnosis, ATrajectoryThatBeginsAnewIsNeverGood) {
  RunEvidence evidence = goodRun();
  evidence.input_faults["imu_clock_restart"] = 1;
  evidence.imu_restarts = {{Time::fromSeconds(1700000020.0), Time::fromSeconds(1700000028.505)}};
  expectSays(
      first(evidence),
      {"imu_clock_restart: The stamps of the IMU jump ahead from 1700000020.000 s to 1700000028.505 s, "
       "more than max_bridged_imu_gap 3 s. There the trajectory starts again at the origin. Run",
       "raise max_bridged_imu_gap"});
  EXPECT_EQ(diagnose(evidence, Config{}).verdict, RunVerdict::kDoubtful);
  evidence.imu_restarts = {{Time::fromSeconds(40.0), Time::fromSeconds(10.0)},
                           {Time::fromSeconds(40.0), Time::fromSeconds(10.0)}};
  expectSays(first(evidence),
             {"jump back from 40.000 s to 10.000 s. The", "at the origin; more such jumps: 1."});
}

TEST(Diagnosis, AGapOfSamplesThatCannotBeUsedIsNoJumpOfTheStamps) {
  RunEvidence evidence = goodRun();
  evidence.input_faults["imu_clock_restart"] = 1;
  evidence.imu_restarts = {{Time::fromSeconds(1700000030.0),
                            Time::fromSeconds(1700000033.5),
                            {{"imu_not_finite", 1227}, {"imu_stamp_jump", 204}},
                            true}};
  const std::string text = first(evidence);
  expectSays(text, {"imu_clock_restart: No sample of the IMU that can be used came for 3.5 s, from "
                    "1700000030.000 s to 1700000033.500 s, more than max_bridged_imu_gap 3 s: 1227 were not "
                    "finite, 204 were good ones after the gap, dropped for imu_jump_patience. There the "
                    "trajectory starts again at the origin. Correct what the driver of the IMU writes"});
  EXPECT_EQ(text.find("jump ahead"), std::string::npos) << text;
}

TEST(Diagnosis, TriggersWithAStampOfZeroAreNamed) {
  RunEvidence evidence = withRejected("trigger_missing");
  evidence.radars.front().name = "left";
  evidence.radars.front().triggers_zero = 210;
  Config config;
  config.trigger_topic = "/trigger";
  expectSays(first(evidence, config),
             {"trigger_stamp_zero: 210 messages on left/trigger_topic /trigger have a stamp of zero, for 200 "
              "scans.",
              "left/stamp_source"});
  EXPECT_EQ(diagnose(evidence, config).causes.size(), 1u) << "that there is no trigger follows from it";
}

TEST(Diagnosis, TheLikeliestThreeComeFirst) {
  RunEvidence evidence = withRejected("innovation");
  evidence.divergences = 2;
  evidence.input_faults = {{"imu_saturated", 400}, {"imu_gap", 100}};
  evidence.scans_diverged = evidence.scans_contradicted = 150;
  const Diagnosis diagnosis = diagnose(evidence, Config{});
  ASSERT_EQ(diagnosis.causes.size(), 3u);
  EXPECT_EQ(diagnosis.causes[0].name, "contradicts_imu");
  EXPECT_EQ(diagnosis.causes[1].name, "diverged");
  EXPECT_TRUE(std::is_sorted(diagnosis.causes.begin(), diagnosis.causes.end(),
                             [](const Cause& a, const Cause& b) { return a.share > b.share; }));
  expectSays(describeCauses(diagnosis), {"  1. 190 of 190 scans", "\n  2. ", "\n  3. "});
  EXPECT_EQ(describeCauses(diagnosis).find("scans_used_share"), std::string::npos)
      << "a cause says it better";
}

TEST(Diagnosis, OneOfSeveralRadarsIsNamed) {
  Config config;
  config.radars.resize(2);
  config.radars[0].radar_name = "left";
  config.radars[1].radar_name = "right";
  RunEvidence evidence = goodRun();
  evidence.radars.push_back(evidence.radars.front());
  evidence.radars[0].name = "left";
  evidence.radars[1].name = "right";
  evidence.radars[1].scans_rejected = {{"innovation", 100}};
  expectSays(first(evidence, config), {"of radar right", "right/extrinsics_rotation_xyzw"});
  EXPECT_EQ(diagnose(evidence, config).verdict, RunVerdict::kDoubtful);
}

TEST(Diagnosis, ManyReasonsForRejectionAreDoubtfulTogether) {
  RunEvidence evidence = goodRun();
  evidence.radars.front().scans_used = 80;
  evidence.radars.front().scans_rejected = {
      {"innovation", 28}, {"too_few_points", 28}, {"too_few_inliers", 28}, {"sigma_too_large", 26}};
  const Diagnosis diagnosis = diagnose(evidence, Config{});
  EXPECT_EQ(diagnosis.verdict, RunVerdict::kDoubtful);
  EXPECT_TRUE(diagnosis.causes.empty());
  EXPECT_EQ(describeCauses(diagnosis), "  scans_used_share is 0.421, expected at least 0.5\n");
}

TEST(Diagnosis, FewScansSayNothing) {
  RunEvidence evidence = withRejected("innovation");
  evidence.radars.front().scans_total = 15;
  EXPECT_EQ(first(evidence), "none");
}

}  // namespace
}  // namespace rio_t
