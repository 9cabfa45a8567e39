// Landmarks: the factor, what may become one, and the whole pipeline with them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "noise.h"
#include "numeric_jacobian.h"
#include "rio_t/core/so3.h"
#include "rio_t/landmarks/candidates.h"
#include "rio_t/landmarks/landmark_map.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

const Eigen::Vector3d g_W(0.0, 0.0, -9.81);

StateBlock someState() {
  StateBlock x;
  x.q_WI() = so3::exp({0.3, -0.2, 1.1});
  x.p_W() = Eigen::Vector3d(1.0, -2.0, 0.5);
  x.v_W() = Eigen::Vector3d(0.7, 0.4, -0.1);
  return x;
}
Extrinsics someMounting() { return {{0.05, -0.1, 0.2}, so3::exp({-0.4, 0.2, 0.9})}; }

ImuDelta someDelta(double dt) {
  ImuDelta delta;
  delta.step(dt, {0.5, -1.0, 0.8}, {1.0, 2.0, 9.0});
  return delta;
}

PolarMeasurement polar(const Eigen::Vector3d& p_R) { return {p_R, 0.05, 0.04, 0.08}; }

std::vector<double> numbers(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }
std::vector<double> numbers(const Extrinsics& T_IR) {
  const Eigen::VectorXd x = stored(T_IR);
  return {x.data(), x.data() + x.size()};
}

TEST(LandmarkFactor, JacobiansAreExact) {
  for (const double dt : {0.0, 0.004, -0.05}) {
    const LandmarkFactor factor(polar({1.0, 5.0, -0.7}), someDelta(dt), g_W);
    expectJacobiansCorrect(factor,
                           {motionOf(someState()), numbers(someMounting()), numbers({4.0, 2.0, 1.5})});
  }
}

TEST(LandmarkFactor, IsZeroWhereThePointIs) {
  const StateBlock x = someState();
  const Extrinsics T_IR = someMounting();
  const Eigen::Vector3d p_R(1.0, 5.0, -0.7);
  const Eigen::Vector3d p_W = x.p_W() + x.q_WI() * (T_IR.l_I + T_IR.q_IR * p_R);
  const LandmarkFactor factor(polar(p_R), ImuDelta(), g_W);
  const std::vector<double> motion = motionOf(x), mounting = numbers(T_IR), point = numbers(p_W);
  const double* const parameters[] = {motion.data(), mounting.data(), point.data()};
  Eigen::Vector3d r;
  ASSERT_TRUE(factor.Evaluate(parameters, r.data(), nullptr));
  EXPECT_LT(r.norm(), 1e-9);
}

/// One sigma of range, azimuth and elevation is a residual of one.
TEST(LandmarkFactor, TheNoiseIsInPolarForm) {
  const double range = 6.0, az = 0.4, el = -0.5;
  const auto at = [](double r, double a, double e) {
    return Eigen::Vector3d(r * std::cos(e) * std::sin(a), r * std::cos(e) * std::cos(a), r * std::sin(e));
  };
  const PolarNoise noise(polar(at(range, az, el)));
  EXPECT_NEAR((noise.at(at(range + 0.05, az, el)).value - Eigen::Vector3d::UnitX()).norm(), 0.0, 1e-9);
  EXPECT_NEAR((noise.at(at(range, az + 0.04, el)).value - Eigen::Vector3d::UnitY()).norm(), 0.0, 0.02);
  EXPECT_NEAR((noise.at(at(range, az, el + 0.08)).value - Eigen::Vector3d::UnitZ()).norm(), 0.0, 0.02);
  const Eigen::Matrix3d J = noise.at(at(range, az, el)).J;
  EXPECT_NEAR((J * noise.covariance() * J.transpose() - Eigen::Matrix3d::Identity()).norm(), 0.0, 1e-9);
}

/// Detections from a radar that goes sideways, `way` [m] in 30 scans.
class CandidatesTest : public ::testing::Test {
 protected:
  static PlacedDetection exactly(double share, double way, const Eigen::Vector3d& p_W) {
    PlacedDetection detection;
    const Time time = Time::fromNanoseconds(1'000'000'000) + 3.0 * share;
    detection.radar_W = Eigen::Vector3d(share * way, 0.0, 0.0);
    detection.covariance = Eigen::Vector3d(0.2 * 0.2, 0.05 * 0.05, 0.3 * 0.3).asDiagonal();
    detection.p_W = p_W;
    detection.snr_db = 20.0;
    detection.time = time;
    detection.sighting.node_time = time;
    return detection;
  }
  PlacedDetection seen(double share, double way, const Eigen::Vector3d& p_W) {
    return exactly(share, way, p_W + Eigen::Vector3d(0.2, 0.05, 0.3).cwiseProduct(noise_.vector()));
  }
  static constexpr int kScans = 30;
  Noise noise_;
  Candidates candidates_;
};

TEST_F(CandidatesTest, AStaticPointIsProvenOnceTheRadarHasMoved) {
  for (int i = 0; i < kScans; ++i) candidates_.add({seen(i / 30.0, 0.1, {0.0, 5.0, 0.0})});
  EXPECT_TRUE(candidates_.takeProven({}, 10).empty()) << "0.1 m do not tell a point from a highlight";
  for (int i = 0; i < kScans; ++i) candidates_.add({seen(i / 30.0, 2.0, {0.0, 5.0, 0.0})});
  const std::vector<Candidate> proven = candidates_.takeProven({}, 10);
  ASSERT_EQ(proven.size(), 1u);
  EXPECT_LT((proven[0].position() - Eigen::Vector3d(0.0, 5.0, 0.0)).norm(), 0.2);
}

TEST_F(CandidatesTest, AHighlightThatSlidesAlongIsNeverProven) {
  for (int i = 0; i < kScans; ++i) {
    candidates_.add({seen(i / 30.0, 1.0, {i / 30.0, 5.0, 0.0})});
    EXPECT_TRUE(candidates_.takeProven({}, 10).empty());
  }
}

TEST_F(CandidatesTest, TwoThingsThatCannotBeToldApartAreNotProven) {
  for (int i = 0; i < kScans; ++i)
    candidates_.add({seen(i / 30.0, 2.0, {0.0, 5.0, 0.0}), seen(i / 30.0, 2.0, {0.3, 5.02, 0.2})});
  EXPECT_TRUE(candidates_.takeProven({}, 10).empty());
}

/// Beyond the gate of the first, and not farther than four sigmas.
TEST_F(CandidatesTest, ASecondThingBesideTheFirstIsNoOutlier) {
  const auto proven = [](double sigmas, int times) {
    Candidates candidates;
    for (int i = 0; i < kScans; ++i) {
      candidates.add({exactly(i / 30.0, 2.0, {0.0, 5.0, 0.0})});
      if (i >= kScans - times) candidates.add({exactly(i / 30.0, 2.0, {0.2 * sigmas, 5.0, 0.0})});
    }
    return candidates.takeProven({}, 10).size();
  };
  EXPECT_EQ(proven(3.7, 1), 1u);
  EXPECT_EQ(proven(3.7, 2), 0u);
  EXPECT_EQ(proven(4.3, 2), 1u);
}

TEST_F(CandidatesTest, NothingBecomesALandmarkBesideAnother) {
  for (int i = 0; i < kScans; ++i) candidates_.add({seen(i / 30.0, 2.0, {0.0, 5.0, 0.0})});
  EXPECT_TRUE(candidates_.takeProven({{0.3, 5.0, 0.0}}, 10).empty());
  EXPECT_EQ(candidates_.takeProven({{3.0, 5.0, 0.0}}, 10).size(), 1u);
}

TEST_F(CandidatesTest, GhostsFillABoundedListAndProveNothing) {
  Random random(7);
  const auto anywhere = [&] { return random.uniform(-10.0, 10.0); };
  for (int i = 0; i < 300; ++i) {
    std::vector<PlacedDetection> ghosts;
    ghosts.reserve(40);
    for (int k = 0; k < 40; ++k) ghosts.push_back(seen(i / 30.0, 1.0, {anywhere(), anywhere(), anywhere()}));
    candidates_.add(ghosts);
    candidates_.forgetOld(ghosts.front().time, ghosts.front().time);
    EXPECT_LE(candidates_.size(), Candidates::kMax);
    EXPECT_TRUE(candidates_.takeProven({}, 10).empty());
  }
}

/// The test draws pairs, some of them by chance. The probability tells the share of true ones, near the
/// landmark and near the edge of the gate.
TEST(ProbabilityOfTruth, IsTheShareOfTruePairs) {
  Random random(3);
  constexpr double kByChance = 0.3;
  constexpr std::size_t kBins = 4;
  std::array<double, kBins> pairs{}, true_pairs{}, expected{};
  for (int i = 0; i < 200000; ++i) {
    const bool by_chance = random.uniform(0.0, 1.0) < kByChance;
    const auto draw = [&] { return by_chance ? random.uniform(-4.0, 4.0) : random.normal(); };
    double q = Candidates::kGate;
    while (q >= Candidates::kGate) q = Eigen::Vector3d(draw(), draw(), draw()).squaredNorm();
    const auto bin = static_cast<std::size_t>(q / Candidates::kGate * kBins);
    pairs[bin] += 1.0;
    true_pairs[bin] += by_chance ? 0.0 : 1.0;
    expected[bin] += probabilityOfTruth(q, kByChance);
  }
  for (std::size_t bin = 0; bin < kBins; ++bin)
    EXPECT_NEAR(expected[bin] / pairs[bin], true_pairs[bin] / pairs[bin], 0.02) << bin;
  EXPECT_GT(true_pairs.front() / pairs.front(), 0.9);
  EXPECT_LT(true_pairs.back() / pairs.back(), 0.3);
}

/// True pairs have a mean of 1, those by chance of 2.27.
TEST(ShareByChance, IsThatOfTheMeanSquare) {
  EXPECT_EQ(shareByChance(0.0, 0.0), 0.5) << "nothing is known";
  EXPECT_NEAR(shareByChance(1.4 * 30.0, 30.0), 0.4 / 1.268, 1e-9);
  EXPECT_EQ(shareByChance(30.0, 30.0), 0.01);
  EXPECT_EQ(shareByChance(2.0 * 30.0, 30.0), 0.5);
}

struct Outcome {
  double rms = 0.0, nees = 0.0;
  double worst = 0.0;  ///< [sigma] of an axis
  std::size_t dropped = 0, largest_map = 0;
};

/// Errors of position in the frame of the start, from `from` seconds on.
Outcome outcomeOf(const SimulatedRun& run, double from) {
  Outcome outcome;
  double count = 0.0;
  for (const ScanResult& result : run.results) {
    if (result.landmarks) {
      outcome.dropped += result.landmarks->dropped_map ? 1 : 0;
      outcome.largest_map = std::max(outcome.largest_map, result.landmarks->map.size());
    }
    if (!result.updated) continue;
    const NavigationState& x = result.state;
    if (run.seconds(x.time) < from) continue;
    const Eigen::Vector3d e = run.wayError(x);
    outcome.rms += e.squaredNorm();
    for (int i = 0; i < 3; ++i) {
      const double square = e[i] * e[i] / x.covariance(StateBlock::kP + i, StateBlock::kP + i);
      outcome.nees += square / 3.0;
      outcome.worst = std::max(outcome.worst, std::sqrt(square));
    }
    count += 1.0;
  }
  outcome.rms = std::sqrt(outcome.rms / count);
  outcome.nees /= count;
  return outcome;
}

Outcome outcome(const std::string& motion, std::uint64_t seed, bool landmarks,
                const std::function<void(simulation::RadarModelOptions&)>& change = nullptr) {
  SimulatedRun run(motion, seed, 60.0, 5.0);
  run.options.landmarks.enabled = landmarks;
  if (change) change(run.setup.radar);
  run.run();
  return outcomeOf(run, 10.0);
}

TEST(Landmarks, HoldThePositionInARoom) {
  double with = 0.0, without = 0.0, nees = 0.0;
  constexpr int kSeeds = 5;  // of the first three, one has almost no drift to remove
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Outcome off = outcome("difficult", seed, false), on = outcome("difficult", seed, true);
    std::printf("seed %d: %.4f m without, %.4f m with, NEES %.2f, map %zu\n", static_cast<int>(seed), off.rms,
                on.rms, on.nees, on.largest_map);
    with += on.rms / kSeeds;
    without += off.rms / kSeeds;
    nees += on.nees / kSeeds;
    EXPECT_EQ(off.largest_map, 0u);
    EXPECT_EQ(on.dropped, 0u);
    EXPECT_LE(on.largest_map, LandmarkOptions().max_landmarks);
  }
  EXPECT_LT(with, 0.6 * without);
  EXPECT_LT(nees, 2.0);
}

/// On a straight line nothing tells a tilt from a bias of the accelerometer, and landmarks do not, either.
TEST(Landmarks, MakeUpNoKnowledgeOfTheTilt) {
  const auto tiltSigma = [](std::uint64_t seed, bool landmarks) {
    SimulatedRun run("constant_speed", seed, 50.0);
    run.options.landmarks.enabled = landmarks;
    run.run();
    const ScanResult& last = run.results.back();
    EXPECT_EQ(landmarks, last.landmarks && last.landmarks->is_trusted) << "the run tests nothing";
    return std::sqrt(last.state.covariance.topLeftCorner<2, 2>().trace());
  };
  for (const std::uint64_t seed : {2, 3, 8}) {
    const double without = tiltSigma(seed, false), with = tiltSigma(seed, true);
    std::printf("seed %d: tilt known to %.4f mrad without, %.4f mrad with\n", static_cast<int>(seed),
                1e3 * without, 1e3 * with);
    EXPECT_NEAR(with, without, 1e-3 * without);
  }
}

/// By default the lever arm is estimated. Without turns, nothing tells it.
TEST(Landmarks, BearALeverArmThatNobodyKnows) {
  SimulatedRun run("constant_speed", 2, 50.0);
  run.options.landmarks.enabled = true;
  run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kLeverArm;
  run.options.radar.extrinsics_translation_sigma = 0.2;
  run.run();
  EXPECT_EQ(outcomeOf(run, 10.0).dropped, 0u);
  const ScanResult& last = run.results.back();
  EXPECT_TRUE(last.landmarks && last.landmarks->is_trusted);
}

/// After a gap of 20 s, some detection lies wherever a landmark might be.
TEST(Landmarks, AreNotGuessedAfterAGap) {
  for (const std::uint64_t seed : {2, 3, 5, 6}) {
    const Outcome gap = outcome("drone", seed, true, [](simulation::RadarModelOptions& radar) {
      radar.blackouts = {{25.0, 20.0}};
    });
    std::printf("seed %d: worst error %.1f sigma\n", static_cast<int>(seed), gap.worst);
    EXPECT_LT(gap.worst, 4.0) << seed;
    EXPECT_GE(gap.dropped, 1u) << seed;
  }
}

TEST(Landmarks, DoNoHarmAmongCrowdsAndGhosts) {
  for (const bool crowd : {true, false}) {
    double with = 0.0, without = 0.0;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const auto spoil = [&](simulation::RadarModelOptions& radar) {
        if (crowd) {
          radar.moving_share = 0.9;
          radar.crowd = 2;
        } else {
          radar.ghost_share = 0.5;
        }
      };
      const Outcome off = outcome("medium", seed, false, spoil), on = outcome("medium", seed, true, spoil);
      std::printf("%s, seed %d: %.4f m without, %.4f m with\n", crowd ? "crowd" : "ghosts",
                  static_cast<int>(seed), off.rms, on.rms);
      with += on.rms;
      without += off.rms;
    }
    EXPECT_LT(with, 1.05 * without);
  }
}

}  // namespace
}  // namespace rio_t
