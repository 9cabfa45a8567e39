/// Errors of trajectories, and of a time offset, against the truth. Figures agree with evo's.
#include <boost/algorithm/string/replace.hpp>
#include <cstdio>
#include <iomanip>
#include <iostream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "../ros/command_line.h"
#include "rio_t/core/replace_file.h"
#include "rio_t/evaluation/errors.h"
#include "rio_t/evaluation/offset_error.h"

namespace {

using namespace rio_t;

const ProgramText kText = {
    "evaluate",
    "GROUND_TRUTH.txt ESTIMATE.txt... [options]\n"
    "--time-offset FILE.csv --true-offset SECONDS [options]\n",
    "Shows the errors of estimated trajectories (TUM format: stamp x y z qx qy qz qw) with the definitions "
    "of evo.",
    "rosrun rio_t evaluate truth.txt out/trajectory.txt\n"
    "rosrun rio_t evaluate --time-offset out/time_offset.csv --true-offset 0.03 --skip 20\n",
    "APE   distance and angle to the truth. The first poses are aligned (origin), or all poses by least "
    "squares\n"
    "      over yaw and position, or over rotation and position (SE3, no scale).\n"
    "RPE   error of the motion over 1 m of the estimate's path and over 1 s. The rmse over 1 m is t_rel, "
    "r_rel.\n"
    "drift error of the last pose, with the first poses aligned, per metre of the truth's path.\n"};

struct Arguments {
  std::vector<std::string> trajectories;  ///< truth first
  std::string errors_file;
  std::string time_offset;
  std::optional<double> true_offset;
  double skip = 0.0;
  double max_difference = kDefaultMaxDifference;
  bool yaml = false;
};

void addOptions(OptionSet& options, Arguments& a) {
  options.values("trajectory", "FILE",
                 "the true trajectory, then the estimates; `--trajectory` may be left out",
                 [&a](const std::string& file) { a.trajectories.push_back(file); });
  options.positional("trajectory");
  options.number(
      "max-difference", "S",
      "largest difference of the stamps of two poses that are compared [s]; the default is that of evo",
      a.max_difference);
  options.text("errors", "FILE",
               "the error of every matched pose of the one estimate goes there (first poses aligned)",
               a.errors_file);
  options.text("time-offset", "FILE", "estimates of the radar's time offset: columns stamp,offset_s,sigma_s",
               a.time_offset);
  options.value("true-offset", "S", "the constant true offset [s]", "",
                [&a](const std::string& text) { a.true_offset = parseNumber(text); });
  options.number("skip", "S", "leaves out the first S seconds of the offsets (convergence)", a.skip);
  options.flag("yaml", "prints YAML for programs", a.yaml);
}

void check(const Arguments& arguments) {
  if (arguments.time_offset.empty() == arguments.true_offset.has_value())
    throw UsageError("--time-offset and --true-offset go together");
  if (!arguments.errors_file.empty() && arguments.trajectories.size() != 2)
    throw UsageError("--errors goes with exactly one estimate");
  std::vector<std::string> inputs = arguments.trajectories;
  inputs.push_back(arguments.time_offset);
  const std::string fault = arguments.errors_file.empty() ? "" : faultOfOutput(arguments.errors_file, inputs);
  if (!fault.empty()) throw UsageError("--errors " + fault);
  if (arguments.trajectories.size() == 1)
    throw UsageError("only one trajectory given, expected GROUND_TRUTH ESTIMATE...");
  if (arguments.trajectories.empty() && arguments.time_offset.empty())
    throw UsageError("nothing to evaluate, expected GROUND_TRUTH ESTIMATE...");
}

/// One way to compare an estimate with the truth.
struct Comparison {
  const char* name;                  ///< for people
  const char* key;                   ///< for programs
  const char* count_name = nullptr;  ///< null: the path is too straight for this alignment
  std::size_t count = 0;
  Statistics metres = {}, degrees = {};
};

struct Evaluation {
  std::string file;
  std::vector<Comparison> comparisons;  ///< the first: over all poses that match
  Drift drift;
};

Evaluation evaluate(const Trajectory& truth, const std::string& truth_file, const Trajectory& estimate,
                    const std::string& file, double max_difference) {
  Evaluation result{file, {}, {}};
  std::vector<Comparison>& all = result.comparisons;
  const auto absolute = [&](const char* name, const char* key, Alignment kind) {
    const AbsoluteError e = absoluteError(truth, estimate, kind, max_difference);
    all.push_back({name, key, "poses", e.matched_poses, e.translation_m, e.rotation_deg});
  };
  const auto absoluteIfPossible = [&](const char* name, const char* key, Alignment kind) {
    try {
      absolute(name, key, kind);
    } catch (const std::invalid_argument&) {
      all.push_back({name, key});  // on a line, or at rest: the origin still aligns
    }
  };
  const auto relative = [&](const char* name, const char* key, DeltaUnit unit, bool all_pairs) {
    const RelativeError e = relativeError(truth, estimate, {1.0, unit, all_pairs}, max_difference);
    all.push_back({name, key, "pairs", e.pairs, e.translation_m, e.rotation_deg});
  };
  try {
    absolute("APE origin (ATE)", "ape_origin", Alignment::kOrigin);
    absoluteIfPossible("APE yaw", "ape_yaw", Alignment::kYaw);
    absoluteIfPossible("APE SE3", "ape_se3", Alignment::kSe3);
    relative("RPE 1 m (t_rel, r_rel)", "rpe_1m", DeltaUnit::kMetres, false);
    relative("RPE 1 m, all pairs", "rpe_1m_all_pairs", DeltaUnit::kMetres, true);
    relative("RPE 1 s", "rpe_1s", DeltaUnit::kSeconds, false);
    result.drift = drift(truth, estimate, max_difference);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(file + " against " + truth_file + ": " + error.what());
  }
  return result;
}

void printRow(const char* name, const Statistics& s, const char* unit, std::size_t count) {
  std::printf("  %-22s %10.6f %10.6f %10.6f %10.6f  %-4s %7zu\n", name, s.rmse, s.mean, s.median, s.max, unit,
              count);
}

void printTable(const Evaluation& e) {
  std::printf("%s\n  %-22s %10s %10s %10s %10s  %-4s %7s\n", e.file.c_str(), "", "rmse", "mean", "median",
              "max", "", "count");
  for (const Comparison& each : e.comparisons) {
    if (each.count_name == nullptr) {
      std::printf("  %-22s not possible: the path is too straight\n", each.name);
    } else if (each.count == 0) {
      std::printf("  %-22s no pairs: the path is too short\n", each.name);
    } else {
      printRow(each.name, each.metres, "m", each.count);
      printRow("", each.degrees, "deg", each.count);
    }
  }
  std::printf("  %-22s %.3f m (%.3f m horizontal), yaw %.2f deg after %.2f m: %.2f %%\n\n",
              "drift at the end", e.drift.final_m, e.drift.final_horizontal_m, e.drift.final_yaw_deg,
              e.drift.path_m, 100.0 * e.drift.per_metre);
}

void printTable(const std::string& file, double truth, const OffsetError& e) {
  std::printf("%s against %.3f ms, %zu samples\n", file.c_str(), 1e3 * truth, e.samples);
  std::printf("  error [ms]             mean %.3f, rmse %.3f, max %.3f, at the end %.3f (sigma %.3f)\n",
              1e3 * e.mean, 1e3 * e.rmse, 1e3 * e.max, 1e3 * e.final_error, 1e3 * e.final_sigma);
  if (e.with_sigma == 0) return;
  std::printf("  within 1, 2, 3 sigma   %.1f %%, %.1f %%, %.1f %% (honest: 68.3, 95.4, 99.7)\n",
              100.0 * e.share_1_sigma, 100.0 * e.share_2_sigma, 100.0 * e.share_3_sigma);
  std::printf("  mean (error/sigma)^2   %.3f (honest: 1)\n", e.mean_normalised_square);
}

/// Single-quoted, so that any file name is one YAML string.
std::string quoted(const std::string& text) {
  return "'" + boost::algorithm::replace_all_copy(text, "'", "''") + "'";
}

// Numbers as %#.9g: with a point, without which YAML 1.1 takes 2e-05 for text.
void yamlRow(const Comparison& c, const char* unit, const Statistics& s) {
  std::printf("    %s_%s: {rmse: %#.9g, mean: %#.9g, median: %#.9g, max: %#.9g, %s: %zu}\n", c.key, unit,
              s.rmse, s.mean, s.median, s.max, c.count_name, c.count);
}

void printYaml(const Evaluation& e) {
  std::printf("  - file: %s\n    matched_poses: %zu\n", quoted(e.file).c_str(), e.comparisons.front().count);
  for (const Comparison& each : e.comparisons) {
    if (each.count_name == nullptr) continue;
    yamlRow(each, "m", each.metres);
    yamlRow(each, "deg", each.degrees);
  }
  std::printf(
      "    drift: {path_m: %#.9g, final_m: %#.9g, final_horizontal_m: %#.9g, final_yaw_deg: %#.9g, "
      "per_metre: %#.9g}\n",
      e.drift.path_m, e.drift.final_m, e.drift.final_horizontal_m, e.drift.final_yaw_deg, e.drift.per_metre);
}

void printYaml(const std::string& file, double truth, const OffsetError& e) {
  std::printf("time_offset:\n  file: %s\n  true_s: %#.9g\n  samples: %zu\n", quoted(file).c_str(), truth,
              e.samples);
  std::printf("  mean_error_s: %#.9g\n  rmse_s: %#.9g\n  max_error_s: %#.9g\n  final_error_s: %#.9g\n",
              e.mean, e.rmse, e.max, e.final_error);
  std::printf("  final_sigma_s: %#.9g\n", e.final_sigma);
  if (e.with_sigma == 0) return;
  std::printf("  share_1_sigma: %#.9g\n  share_2_sigma: %#.9g\n  share_3_sigma: %#.9g\n", e.share_1_sigma,
              e.share_2_sigma, e.share_3_sigma);
  std::printf("  mean_normalised_square: %#.9g\n", e.mean_normalised_square);
}

/// The content of the file of --errors.
std::string errorTable(const Trajectory& truth, const Trajectory& estimate, double max_difference) {
  std::ostringstream out;
  out << std::setprecision(9) << "stamp,x,y,z,truth_x,truth_y,truth_z,angle_deg,yaw_deg\n";
  for (const PoseError& e : poseErrors(truth, estimate, Alignment::kOrigin, max_difference)) {
    out << formatTime(e.time);
    for (const double value : {e.p_T.x(), e.p_T.y(), e.p_T.z(), e.truth_T.x(), e.truth_T.y(), e.truth_T.z(),
                               e.angle_deg, e.yaw_deg}) {
      out << ',' << value;
    }
    out << '\n';
  }
  return out.str();
}

void run(const Arguments& arguments) {
  // Computes everything before it writes anything, so that a failure leaves no half output.
  std::vector<Evaluation> evaluations;
  std::string errors;
  if (!arguments.trajectories.empty()) {
    const std::string& truth_file = arguments.trajectories.front();
    const Trajectory truth = readTum(truth_file);
    for (std::size_t i = 1; i < arguments.trajectories.size(); ++i) {
      const std::string& file = arguments.trajectories[i];
      const Trajectory estimate = readTum(file);
      evaluations.push_back(evaluate(truth, truth_file, estimate, file, arguments.max_difference));
      if (!arguments.errors_file.empty()) errors = errorTable(truth, estimate, arguments.max_difference);
    }
  }
  std::optional<OffsetError> offset;
  if (!arguments.time_offset.empty()) {
    const std::vector<OffsetSample> samples = readTimeOffsets(arguments.time_offset);
    try {
      offset = offsetError(samples, *arguments.true_offset, arguments.skip);
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(arguments.time_offset + ": " + error.what());
    }
  }

  if (!arguments.errors_file.empty()) replaceFile(arguments.errors_file, errors);
  if (arguments.yaml) {
    if (!evaluations.empty()) {
      std::printf("ground_truth: %s\nmax_difference_s: %#.9g\nestimates:\n",
                  quoted(arguments.trajectories.front()).c_str(), arguments.max_difference);
    }
    for (const Evaluation& evaluation : evaluations) printYaml(evaluation);
    if (offset) printYaml(arguments.time_offset, *arguments.true_offset, *offset);
    return;
  }
  for (const Evaluation& evaluation : evaluations) printTable(evaluation);
  if (offset) printTable(arguments.time_offset, *arguments.true_offset, *offset);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  OptionSet options("Options");
  addOptions(options, arguments);
  return runProgram(kText, options, {argv + 1, argv + argc}, std::cout, std::cerr, [&] {
    check(arguments);
    run(arguments);
    return kExitOk;
  });
}
