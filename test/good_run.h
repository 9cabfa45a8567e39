#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "rio_t/ros/diagnosis/diagnosis.h"

namespace rio_t {

inline std::uint64_t& pointsOf(RunEvidence& evidence, PointVerdict verdict) {
  return evidence.radars.front().points_by_verdict[static_cast<std::size_t>(verdict)];
}

/// A good run of 200 scans: some points filtered, some scans rejected.
inline RunEvidence goodRun() {
  RunEvidence evidence;
  evidence.initialized = true;
  evidence.heading_sigma = 0.05;
  evidence.imu_count = 4000;
  evidence.input_faults = {{"imu_gap", 2}, {"imu_saturated", 20}};
  evidence.scans_judged = 190;
  evidence.solver_terminations = {{"at_bound", 3}, {"converged", 177}};
  RadarSummary& radar = evidence.radars.emplace_back();
  radar.scans_total = 200;
  radar.scans_used = 175;
  radar.scans_before_start = 10;
  radar.velocity_status = {{"moving", 8}, {"too_few_points", 2}};
  radar.scans_rejected = {{"innovation", 8}, {"too_few_points", 7}};
  radar.points = 10000;
  radar.snr_sum_db = 150000.0;
  pointsOf(evidence, PointVerdict::kKept) = 7000;
  pointsOf(evidence, PointVerdict::kTooWeak) = 2500;
  pointsOf(evidence, PointVerdict::kTooNear) = 500;
  return evidence;
}

/// The likeliest cause, as "name: text remedy".
inline std::string first(const RunEvidence& evidence, const Config& config = Config{}) {
  const Diagnosis diagnosis = diagnose(evidence, config);
  if (diagnosis.causes.empty()) return "none";
  for (const Cause& each : diagnosis.causes)
    EXPECT_EQ(each.remedy_is_check_bag, each.remedy.find("check_bag") != std::string::npos) << each.name;
  const Cause& cause = diagnosis.causes.front();
  return cause.name + ": " + cause.text + " " + cause.remedy;
}

inline void expectSays(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts)
    EXPECT_NE(text.find(part), std::string::npos) << part << " not in: " << text;
}

}  // namespace rio_t
