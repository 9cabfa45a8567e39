#include <cmath>
#include <string>

#include "rio_t/ros/bag/bag_runner.h"

namespace rio_t {
namespace {

std::string decimal(double value, int decimals) {
  std::string text;
  appendFixed(&text, value, decimals);
  return text;
}

std::string describeStep(const DopplerStep& step) {
  switch (step.source) {
    case DopplerStepSource::kUnknown:
      return "not known: too few points that move; " + decimal(step.value, 3) + " m/s was taken";
    case DopplerStepSource::kGiven:
      return decimal(step.value, 3) + " m/s, given";
    case DopplerStepSource::kData:
      break;
  }
  return (step.value > 0.0 ? decimal(step.value, 3) + " m/s" : std::string("none")) + ", from the data";
}

}  // namespace

std::string describeRun(const RunSummary& summary, const std::string& files) {
  std::string table;
  const auto row = [&](const char* name, const std::string& value) {
    table += "  " + std::string(name) + std::string(16 - std::string(name).size(), ' ') + value + "\n";
  };
  const auto percent = [&](double metres) {
    return summary.path_length_m > 0.1 ? " (" + decimal(100.0 * metres / summary.path_length_m, 2) + " %)"
                                       : std::string();
  };
  std::string scans =
      std::to_string(summary.scans_used) + " of " + std::to_string(summary.scans_total) + " used";
  for (const auto& [reason, count] : summary.scans_rejected)
    scans += ", " + std::to_string(count) + " " + reason;
  if (summary.batch) {
    row("batch", (summary.batch->converged ? "converged after " : "NOT converged after ") +
                     std::to_string(summary.batch->iterations) + " iterations, nodes placed " +
                     std::to_string(summary.batch->placements) + " times, " +
                     std::to_string(summary.batch->scans_readmitted) + " scans taken back");
  }
  if (!summary.pass_offsets_s.empty()) {
    std::string offsets;
    for (const double offset : summary.pass_offsets_s)
      offsets += (offsets.empty() ? "" : ", ") + decimal(1e3 * offset, 2);
    row("after passes", offsets + " ms");
  }
  row("path", decimal(summary.path_length_m, 2) + " m");
  row("end to start", decimal(summary.end_to_start_2d_m, 3) + " m" + percent(summary.end_to_start_2d_m) +
                          " horizontal, " + decimal(summary.end_to_start_3d_m, 3) + " m" +
                          percent(summary.end_to_start_3d_m) + " in 3D");
  row("time offset", decimal(1e3 * summary.final_offset_s, 2) + " ms, sigma " +
                         decimal(1e3 * summary.final_offset_sigma_s, 2) + " ms");
  row("radar noise", "Doppler " + decimal(std::sqrt(summary.radar_noise.doppler), 3) + " m/s, azimuth " +
                         decimal(std::sqrt(summary.radar_noise.azimuth), 3) + " rad, elevation " +
                         decimal(std::sqrt(summary.radar_noise.elevation), 3) + " rad");
  row("Doppler step", describeStep(summary.radar_doppler_step));
  if (summary.truth) {
    std::string errors = "ATE " + decimal(summary.truth->ate_m, 3) + " m";
    if (summary.truth->t_rel) {
      errors += ", t_rel " + decimal(*summary.truth->t_rel, 4) + " m/m, r_rel " +
                decimal(*summary.truth->r_rel_deg, 3) + " deg/m";
    }
    row("against truth", errors);
  }
  row("scans", scans);
  std::uint64_t windows = 0;
  for (const auto& [reason, count] : summary.solver_terminations) windows += count;
  std::string unsolved;
  for (const auto& [reason, count] : summary.solver_terminations) {
    if (reason == toString(SolverTermination::kConverged)) continue;
    unsolved += (unsolved.empty() ? "" : ", ") + std::to_string(count) + " of " + std::to_string(windows) +
                " windows " + reason;
  }
  if (!unsolved.empty()) row("solver", unsolved);
  if (!summary.input_faults.empty()) {
    std::string faults;
    for (const auto& [name, count] : summary.input_faults)
      faults += (faults.empty() ? "" : ", ") + std::to_string(count) + " " + name;
    row("input faults", faults);
  }
  row("started from", summary.initialized_from);
  if (summary.divergences > 0 || summary.health_at_end != "ok") {
    row("DO NOT TRUST", "diverged " + std::to_string(summary.divergences) + " times, re-initialised " +
                            std::to_string(summary.reinitializations) + " times, at the end " +
                            summary.health_at_end);
  }
  row("speed", decimal(summary.estimation_seconds, 2) + " s, " + decimal(summary.realtime_factor, 0) +
                   " times real time");
  row("files in", files);
  return table;
}

}  // namespace rio_t
