#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <string>

#include "../text.h"
#include "rio_t/core/angle.h"
#include "rio_t/ros/bag/bag_runner.h"

namespace rio_t {
namespace {

std::string describeStep(const KnownDoppler& step) {
  switch (step.source) {
    case DopplerSource::kUnknown:
      return "not known: too few points that move; " + fixedText(step.value, 3) + " m/s was taken";
    case DopplerSource::kGiven:
      return fixedText(step.value, 3) + " m/s, given";
    case DopplerSource::kData:
      break;
  }
  return (step.value > 0.0 ? fixedText(step.value, 3) + " m/s" : std::string("none")) + ", from the data";
}

std::string describeSpan(const KnownDoppler& span) {
  if (span.source == DopplerSource::kUnknown) return "none seen";
  return fixedText(span.value, 3) + " m/s, " +
         (span.source == DopplerSource::kGiven ? "given"
                                               : "from the data: faster points appear at its other end");
}

/// "3 late, 1 empty"
std::string listOf(const Counts& counts) {
  std::string list;
  for (const auto& [name, count] : counts) appendItem(&list, std::to_string(count) + " " + name);
  return list;
}

std::string describeScans(std::uint64_t used, std::uint64_t total, const Counts& rejected) {
  return std::to_string(used) + " of " + std::to_string(total) + " used" +
         (rejected.empty() ? "" : ", " + listOf(rejected));
}

using Row = std::function<void(const std::string& name, const std::string& value)>;

void describePasses(const RadarSummary& radar, const Row& row) {
  if (radar.pass_offsets_s.empty()) return;
  std::string offsets;
  for (const double offset : radar.pass_offsets_s) appendItem(&offsets, fixedText(1e3 * offset, 2));
  row("after passes", offsets + " ms");
}

/// Describes how far the estimate moved the mounting from the configured one, by the axes of the IMU.
void describeExtrinsics(const ExtrinsicsSummary& extrinsics, const Row& row) {
  if (!extrinsics.rotationSigma().isZero())
    row("turned by", fixedTexts(1.0 / kDegree * turnBetween(extrinsics.configured, extrinsics.T_IR), 2, " ") +
                         " deg about x y z of the IMU, sigma " +
                         fixedTexts(1.0 / kDegree * extrinsics.rotationSigma(), 2, " ") + " deg");
  if (extrinsics.translationSigma().isZero()) return;
  row("moved by", fixedTexts(1e3 * (extrinsics.T_IR.l_I - extrinsics.configured.l_I), 1, " ") +
                      " mm, sigma " + fixedTexts(1e3 * extrinsics.translationSigma(), 1, " ") + " mm");
}

void describeRadar(const RadarSummary& radar, const Row& row) {
  row("time offset", fixedText(1e3 * radar.final_offset_s, 2) + " ms, sigma " +
                         fixedText(1e3 * radar.final_offset_sigma_s, 2) + " ms");
  if (radar.extrinsics) describeExtrinsics(*radar.extrinsics, row);
  row("radar noise", "Doppler " + fixedText(std::sqrt(radar.knowledge.noise.doppler), 3) + " m/s, azimuth " +
                         fixedText(std::sqrt(radar.knowledge.noise.azimuth), 3) + " rad, elevation " +
                         fixedText(std::sqrt(radar.knowledge.noise.elevation), 3) + " rad");
  row("Doppler step", describeStep(radar.knowledge.doppler_step));
  row("Doppler span", describeSpan(radar.knowledge.doppler_span));
}

void describeAids(const RunSummary& summary, const Row& row) {
  if (summary.barometer) {
    row("barometer", std::to_string(summary.barometer->used) + " means of " +
                         std::to_string(summary.barometer->pressures) + " pressures, " +
                         std::to_string(summary.barometer->steps) + " steps, bias " +
                         fixedText(summary.barometer->bias, 2) + " m");
  }
  if (summary.ground_vehicle) {
    row("ground vehicle", summary.ground_vehicle->contradicted_at
                              ? "CONTRADICTED by the motion, switched off"
                              : std::to_string(summary.ground_vehicle->used) + " terms, " +
                                    std::to_string(summary.ground_vehicle->left_out) + " left out");
  }
  if (summary.landmarks) {
    row("landmarks", "the map was trusted in " + std::to_string(summary.landmarks->scans_trusted) + " of " +
                         std::to_string(summary.landmarks->scans) + " scans, at most " +
                         std::to_string(summary.landmarks->most_in_map) + " landmarks");
  }
}

void describeSolver(const Counts& terminations, const Row& row) {
  std::uint64_t windows = 0;
  for (const auto& [reason, count] : terminations) windows += count;
  std::string unsolved;
  for (const auto& [reason, count] : terminations) {
    if (reason == toString(SolverTermination::kConverged)) continue;
    appendItem(&unsolved, std::to_string(count) + " of " + std::to_string(windows) + " windows " + reason);
  }
  if (!unsolved.empty()) row("solver", unsolved);
}

}  // namespace

std::string describeRun(const RunSummary& summary, const std::string& files) {
  std::string table;
  const auto row = [&](const std::string& name, const std::string& value) {
    table += "  " + name + std::string(name.size() < 15 ? 16 - name.size() : 1, ' ') + value + "\n";
  };
  const auto percent = [&](double metres) {
    return summary.path_length_m > 0.1 ? " (" + fixedText(100.0 * metres / summary.path_length_m, 2) + " %)"
                                       : std::string();
  };
  if (summary.batch) {
    row("batch", (summary.batch->converged ? "converged after " : "NOT converged after ") +
                     std::to_string(summary.batch->iterations) + " iterations, nodes placed " +
                     std::to_string(summary.batch->placements) + " times");
  }
  const bool one_radar = summary.radars.size() == 1;
  if (one_radar) describePasses(summary.radars.front(), row);
  row("path", fixedText(summary.path_length_m, 2) + " m");
  if (summary.imu_restarts.empty())
    row("end to start", fixedText(summary.end_to_start_2d_m, 3) + " m" + percent(summary.end_to_start_2d_m) +
                            " horizontal, " + fixedText(summary.end_to_start_3d_m, 3) + " m" +
                            percent(summary.end_to_start_3d_m) + " in 3D");
  if (one_radar) describeRadar(summary.radars.front(), row);
  if (summary.truth) {
    std::string errors = "ATE " + fixedText(summary.truth->ate_m, 3) + " m";
    if (summary.truth->t_rel) {
      errors += ", t_rel " + fixedText(*summary.truth->t_rel, 4) + " m/m, r_rel " +
                fixedText(*summary.truth->r_rel_deg, 3) + " deg/m";
    }
    row("against truth", errors);
  }
  row("scans", describeScans(summary.scansUsed(), summary.scansTotal(), summary.scansRejected()));
  describeAids(summary, row);
  describeSolver(summary.solver_terminations, row);
  if (!summary.input_faults.empty()) row("input faults", listOf(summary.input_faults));
  row("started from", toString(summary.initialized_from));
  if (summary.divergences > 0 || summary.health != Health::kOk) {
    row("diverged", std::to_string(summary.divergences) + " times, re-initialised " +
                        std::to_string(summary.reinitializations) + " times, at the end " +
                        toString(summary.health));
  }
  if (!one_radar) {
    for (const RadarSummary& radar : summary.radars) {
      table += "  radar " + radar.name + "\n";
      const auto indented = [&](const std::string& name, const std::string& value) {
        row("  " + name, value);
      };
      describePasses(radar, indented);
      describeRadar(radar, indented);
      indented("scans", describeScans(radar.scans_used, radar.scans_total, radar.scans_rejected));
    }
  }
  row("speed", fixedText(summary.estimation_seconds, 2) + " s, " + fixedText(summary.realtime_factor, 0) +
                   " times real time");
  row("files in", files.empty() ? "none; --output-dir FOLDER writes them" : files);
  const RunVerdict verdict = summary.diagnosis.verdict;
  row("verdict", verdict == RunVerdict::kGood       ? "good"
                 : verdict == RunVerdict::kDoubtful ? "DOUBTFUL, because:"
                                                    : "BAD, do not trust it, because:");
  table += describeCauses(summary.diagnosis);
  return table;
}

}  // namespace rio_t
