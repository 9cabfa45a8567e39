// Times the stages of the product without a change to it: these definitions take the place of the libraries'
// (a program's symbols come before those of its shared libraries), time the call, and pass it on.
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "rio_t/odometry/imu_propagator.h"
#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/ros/bag/run_output.h"
#include "rio_t/ros/cloud/point_cloud.h"
#include "rio_t/sensors/radar_in_window.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "stage_clock.h"

namespace rio_t {
namespace {

using bench::Stage;
using Scope = bench::StageClock::Scope;

/// The library's function of the same name as `own`, a function or member function of this program.
template <typename Function>
Function libraryFunction(Function own) {
  void* address = nullptr;
  std::memcpy(&address, &own, sizeof(address));  // a pointer to a member function begins with the address
  Dl_info info{};
  void* found = nullptr;
  if (dladdr(address, &info) != 0 && info.dli_sname != nullptr) found = dlsym(RTLD_NEXT, info.dli_sname);
  if (found == nullptr) {
    std::fprintf(stderr, "bag_benchmark: a timed function of the libraries was not found: %s\n",
                 info.dli_sname != nullptr ? info.dli_sname : "it has no symbol");
    std::abort();
  }
  std::memcpy(&own, &found, sizeof(found));
  return own;
}

}  // namespace

DecodedScan decode(const sensor_msgs::PointCloud2& message, const PointCloudFormat& format) {
  static const auto original = libraryFunction(&decode);
  const Scope scope(Stage::kDecode);
  return original(message, format);
}

RadarScan toRadarScan(const pcl::PointCloud<RadarPointPcl>& cloud, Time stamp) {
  static const auto original = libraryFunction(&toRadarScan);
  const Scope scope(Stage::kDecode);
  return original(cloud, stamp);
}

EgoVelocity EgoVelocityEstimator::estimate(const RadarScan& scan,
                                           const std::optional<VelocityPrior>& prior) const {
  static const auto original = libraryFunction(&EgoVelocityEstimator::estimate);
  const Scope scope(Stage::kEgoVelocity);
  return (this->*original)(scan, prior);
}

std::optional<RadarVelocityPrediction> RadarInWindow::predict(const FixedLagSmoother& smoother,
                                                              Time stamp) const {
  static const auto original = libraryFunction(&RadarInWindow::predict);
  const Scope scope(Stage::kPrediction);
  return (this->*original)(smoother, stamp);
}

bool RadarInWindow::add(FixedLagSmoother& smoother, const RadarVelocityMeasurement& z) {
  using Add = bool (RadarInWindow::*)(FixedLagSmoother&, const RadarVelocityMeasurement&);
  static const auto original = libraryFunction<Add>(&RadarInWindow::add);
  const Scope scope(Stage::kFactors);
  return (this->*original)(smoother, z);
}

bool RadarInWindow::add(FixedLagSmoother& smoother, const DopplerMeasurement& z) {
  using Add = bool (RadarInWindow::*)(FixedLagSmoother&, const DopplerMeasurement&);
  static const auto original = libraryFunction<Add>(&RadarInWindow::add);
  const Scope scope(Stage::kFactors);
  return (this->*original)(smoother, z);
}

const Solution& FixedLagSmoother::optimize() {
  static const auto original = libraryFunction(&FixedLagSmoother::optimize);
  const Scope scope(Stage::kSolve);
  return (this->*original)();
}

Eigen::MatrixXd FixedLagSmoother::newestCovariance(const std::vector<const Block*>& calibration) const {
  static const auto original = libraryFunction(&FixedLagSmoother::newestCovariance);
  const Scope scope(Stage::kCovariance);
  return (this->*original)(calibration);
}

std::vector<NodeEstimate> FixedLagSmoother::marginalize(const std::vector<RandomWalk>& walks) {
  static const auto original = libraryFunction(&FixedLagSmoother::marginalize);
  const Scope scope(Stage::kMarginalise);
  return (this->*original)(walks);
}

void ImuPropagator::anchor(const NavigationState& state, bool at_rest) {
  static const auto original = libraryFunction(&ImuPropagator::anchor);
  const Scope scope(Stage::kAnchor);
  (this->*original)(state, at_rest);
}

void ImuPropagator::add(const ImuMeasurement& imu) {
  static const auto original = libraryFunction(&ImuPropagator::add);
  const Scope scope(Stage::kNavigation);
  (this->*original)(imu);
}

Navigation::Checked RadarInertialOdometry::addImu(const ImuMeasurement& imu) {
  static const auto original = libraryFunction(&RadarInertialOdometry::addImu);
  const Scope scope(Stage::kPipeline);
  return (this->*original)(imu);
}

std::vector<ScanResult> RadarInertialOdometry::process(std::size_t max_scans) {
  static const auto original = libraryFunction(&RadarInertialOdometry::process);
  const Scope scope(Stage::kPipeline);
  return (this->*original)(max_scans);
}

void RunOutput::addState(const NavigationState& state) {
  static const auto original = libraryFunction(&RunOutput::addState);
  const Scope scope(Stage::kOutput);
  (this->*original)(state);
}

void RunOutput::addResult(const ScanResult& result) {
  static const auto original = libraryFunction(&RunOutput::addResult);
  const Scope scope(Stage::kOutput);
  (this->*original)(result);
}

}  // namespace rio_t
