// Writes a bag with known truth. See `simulate --help`.
#include <algorithm>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../ros/text.h"
#include "rio_t/core/angle.h"
#include "rio_t/evaluation/trajectory.h"
#include "rio_t/simulation/motions.h"
#include "simulate_options.h"

namespace {

using namespace rio_t;
using namespace rio_t::simulation;

ProgramText programText() {
  std::ostringstream notes;
  notes << "Defaults are in brackets. Noise is that of an ADIS16448 and a TI IWR6843AOP, measured on a real "
           "bag. Angles are\nin radians, unless the name of the option says deg.\n"
           "\n--radar: KEY is an option of the two sections on time offset and radar, without dashes; a flag "
           "stands alone.\nOptions that a radar leaves out come from outside of --radar. Each has its own "
           "reflectors, persons and ghosts.\n--preset kart_pair has left and right: --radar changes one of "
           "them, or adds another.\n"
           "Topics, irs:       /sensor_platform/radar_NAME/scan, /sensor_platform/radar_NAME/trigger\n"
           "Topics, ti_mmwave: /ti_mmwave/radar_scan_pcl_NAME, /sensor_platform/radar_NAME/trigger\n"
           "\nMotions (duration with rest)\n";
  for (const MotionDescription& motion : builtInMotions()) {
    notes << "  " << std::left << std::setw(18) << motion.name << motion.summary << " ("
          << motion.default_duration << " s)\n";
  }
  notes << "\nPresets (motion)\n";
  for (const Preset& preset : presets()) {
    notes << "  " << std::left << std::setw(18) << preset.name << preset.summary << " (" << preset.motion
          << ")\n";
  }
  return {"simulate", "(--motion NAME | --trajectory FILE.txt | --preset NAME) --out FILE.bag [options]\n",
          "Writes a bag of a simulated IMU and radar whose motion and time offset are known.",
          "rosrun rio_t simulate --motion difficult --time-offset 0.03 --seed 1 --out sim.bag\n"
          "rosrun rio_t simulate --preset kart --out kart.bag --ground-truth truth.txt\n"
          "rosrun rio_t simulate --preset kart_pair --radar \"left time-offset=0.03\" --out pair.bag\n",
          notes.str()};
}

Motion motionFromFile(const Request& request) {
  Trajectory poses = readTum(request.trajectory);
  if (request.duration > 0.0) {
    const double wanted = Motion::pathDuration(request.duration, request.rest);
    while (!poses.empty() && poses.back().time - poses.front().time > wanted) poses.pop_back();
  }
  return Motion(TrajectorySpline(poses, request.smoothing), request.rest);
}

Motion motionOf(const Request& request) {
  const bool preset = request.motion.empty() && request.trajectory.empty() && !request.preset.motion.empty();
  const std::string& name = preset ? request.preset.motion : request.motion;
  if (name.empty() == request.trajectory.empty()) {
    throw UsageError("exactly one of --motion and --trajectory is needed, or a --preset");
  }
  if (request.out.empty()) throw UsageError("--out: the bag to write is not given");
  if (!request.trajectory.empty()) {
    if (request.speed) {
      throw UsageError(
          "--speed: only the motions constant_speed and walk can be given one, a trajectory has its own");
    }
    try {
      return motionFromFile(request);
    } catch (const std::invalid_argument& error) {
      throw UsageError("--trajectory " + request.trajectory + ": " + error.what());
    }
  }
  const double duration = preset && request.duration == 0.0 ? request.preset.duration : request.duration;
  return makeMotion({name, request.simulation.seed, duration, request.rest, request.speed});
}

std::string triple(const Eigen::Vector3d& v) { return fixedTexts(v, 5, " "); }

void printRadar(const std::string& title, const RadarSetup& setup, const std::vector<SimulatedScan>& scans) {
  std::size_t delivered = 0, points = 0;
  for (const SimulatedScan& scan : scans) {
    delivered += scan.delivered ? 1 : 0;
    points += scan.points.size();
  }
  std::cout << title << ": " << delivered << " scans of " << scans.size() << " triggers, "
            << std::setprecision(2)
            << (delivered > 0 ? static_cast<double>(points) / static_cast<double>(delivered) : 0.0)
            << " points each; true time offset: " << std::setprecision(6) << scans.front().time_offset
            << " s";
  if (scans.back().time_offset != scans.front().time_offset) {
    std::cout << " at the start, " << scans.back().time_offset << " s at the end";
  }
  std::cout << " (against arrival: " << setup.radar.latency << " s more)\n";
}

void printSummary(const Request& request, const Motion& motion, const SensorData& data) {
  double path = 0.0, speed = 0.0, rate = 0.0, acceleration = 0.0;
  constexpr double kStep = 0.005;
  for (double t = 0.0; t <= motion.duration(); t += kStep) {
    const MotionState state = motion.at(t);
    path += kStep * state.v_W.norm();
    speed = std::max(speed, state.v_W.norm());
    rate = std::max(rate, state.omega_I.norm());
    acceleration = std::max(acceleration, state.a_W.norm());
  }
  std::cout << std::fixed << std::setprecision(2) << "motion: " << motion.duration() << " s (rest "
            << motion.rest().static_start << " s at the start, " << motion.rest().static_end
            << " s at the end), " << path << " m, up to " << speed << " m/s, " << rate << " rad/s, "
            << acceleration << " m/s^2\n";
  if (!request.trajectory.empty()) {
    std::cout << "spline: poses of the file are " << 1e3 * motion.path().positionResidual() << " mm and "
              << motion.path().rotationResidual() / kDegree << " deg (rms) from it\n";
  }
  std::cout << "IMU: " << data.imu.samples.size() << " samples\n"
            << "true accelerometer bias [m/s^2]: " << triple(data.imu.b_a.front()) << " at the start, "
            << triple(data.imu.b_a.back()) << " at the end\n"
            << "true gyro bias [rad/s]: " << triple(data.imu.b_g.front()) << " at the start, "
            << triple(data.imu.b_g.back()) << " at the end\n";
  if (!data.pressures.empty())
    std::cout << "barometer: " << data.pressures.size() << " samples, true drift at the end "
              << data.pressures.back().drift << " Pa\n";
  if (data.radars.empty()) printRadar("radar", request.simulation, data.scans);
  for (const auto& [name, scans] : data.radars) {
    printRadar("radar " + name, request.simulation.radars.at(name), scans);
  }
  std::cout << "wrote " << request.out;
  if (!request.ground_truth.empty()) std::cout << " and " << request.ground_truth;
  std::cout << "\n";
}

void run(Request request) {
  if (!request.simulation.barometer.shocks.empty() && !request.simulation.barometer.enabled)
    throw UsageError("--pressure-shock needs --barometer");
  if (isSameFile(request.ground_truth, request.out))
    throw UsageError("--ground-truth " + request.ground_truth + ": expected another file than that of --out");
  for (const auto& [name, file] :
       {std::make_pair("--out ", request.out), std::make_pair("--ground-truth ", request.ground_truth)}) {
    if (file.empty()) continue;
    const std::string fault = faultOfOutput(file, {request.trajectory});
    if (!fault.empty()) throw UsageError(name + fault);
  }
  constexpr double kLastStamp = 4294967295.0;  // [s] ROS has 32 bits for the seconds
  if (request.start_time > kLastStamp)
    throw UsageError("--start-time " + shortText(request.start_time, 12) +
                     ": expected at most 4294967295, the last stamp of ROS");
  // A bag takes no message of time 0.
  const double record_start = request.start_time + request.bag.record_offset;
  if (!(record_start >= 1e-9 && record_start <= kLastStamp))
    throw UsageError("--record-offset " + shortText(request.bag.record_offset, 10) + " and --start-time " +
                     shortText(request.start_time, 10) +
                     ": expected a record that starts between 0 and 4294967295 s, got " +
                     shortText(record_start, 10) + " s");
  request.simulation.start = Time::fromSeconds(request.start_time);
  const Motion motion = motionOf(request);
  Trajectory truth;
  if (!request.ground_truth.empty())
    truth = groundTruth(motion, request.ground_truth_file_rate, request.simulation.start);
  const SensorData data = simulate(motion, request.simulation);
  writeSimulationBag(request.out, motion, data, request.simulation.start, request.bag);
  if (!request.ground_truth.empty()) writeTum(request.ground_truth, truth);
  printSummary(request, motion, data);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command_line;
  return runProgramWith(programText(), command_line.options(), {argv + 1, argv + argc}, std::cout, std::cerr,
                        [&](const OptionSet::Given& given) {
                          try {
                            run(command_line.read(given));
                          } catch (const std::invalid_argument& error) {
                            throw UsageError(error.what());  // everything comes from the command line
                          }
                          return kExitOk;
                        });
}
