#include "rio_t/odometry/radar_inertial_odometry.h"

#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include "rio_t/odometry/estimator.h"

namespace rio_t {

struct RadarInertialOdometry::Impl {
  explicit Impl(const OdometryOptions& options_in)
      : options(options_in),
        navigation(options, Eigen::Vector3d(0.0, 0.0, -options.gravity)),
        estimator(options, navigation, faults) {}

  /// Hands the inbox to the estimator. Returns the results of scans that waited for a clock that has jumped.
  std::vector<ScanResult> takeInbox();
  /// Uses the waiting scans as far as possible, since the IMU that they wait for will not come.
  std::vector<ScanResult> useWaitingScans();
  /// Takes the next scan that need not wait, if there is one.
  std::optional<RadarScan> nextScan(bool imu_has_ended);
  void shareStatus();

  const OdometryOptions options;
  FaultCounters faults;
  Navigation navigation;

  // From the feeding threads to the estimator; guarded by inbox_mutex.
  struct Inbox {
    std::vector<ImuMeasurement> imu;
    std::vector<RadarScan> scans;
    std::vector<Pressure> pressures;
    std::uint64_t clock_restarts = 0;  ///< of the IMU's clock, before the samples in `imu`
    std::optional<Tuning> tuning;
  };
  // Status of the estimator; guarded by inbox_mutex, too.
  struct Status {
    bool initialized = false;
    StartWait waiting_for;
    Health health = Health::kOk;
  };
  mutable std::mutex inbox_mutex;
  Inbox inbox;
  Status status;

  // Only the thread in process() touches these.
  Estimator estimator;
  std::vector<RadarScan> waiting_scans;  ///< in the order in which they came
};

RadarInertialOdometry::RadarInertialOdometry(const OdometryOptions& options)
    : impl_(std::make_unique<Impl>(options)) {
  impl_->shareStatus();
}
RadarInertialOdometry::~RadarInertialOdometry() = default;
RadarInertialOdometry::RadarInertialOdometry(RadarInertialOdometry&&) noexcept = default;
RadarInertialOdometry& RadarInertialOdometry::operator=(RadarInertialOdometry&&) noexcept = default;

Navigation::Checked RadarInertialOdometry::addImu(const ImuMeasurement& imu) {
  Impl& m = *impl_;
  Navigation::Checked checked = m.navigation.add(imu);
  for (const char* fault : checked.faults) m.faults.count(fault);
  if (checked.taken.empty()) return checked;
  const std::lock_guard<std::mutex> lock(m.inbox_mutex);
  if (m.inbox.clock_restarts != checked.clock_restarts) {
    m.inbox.clock_restarts = checked.clock_restarts;
    m.inbox.imu.clear();
    m.inbox.pressures.clear();
    m.status.initialized = false;
  }
  m.inbox.imu.insert(m.inbox.imu.end(), checked.taken.begin(), checked.taken.end());
  return checked;
}

void RadarInertialOdometry::addScan(RadarScan scan) {
  const std::size_t radars = impl_->options.radarCount();
  if (scan.radar >= radars)
    throw std::invalid_argument("scan of radar " + std::to_string(scan.radar) + ": expected one of the " +
                                std::to_string(radars) + " that the options have, counted from 0");
  const std::lock_guard<std::mutex> lock(impl_->inbox_mutex);
  impl_->inbox.scans.push_back(std::move(scan));
}

void RadarInertialOdometry::addPressure(const Pressure& pressure) {
  if (!impl_->options.use_barometer) return;
  const std::lock_guard<std::mutex> lock(impl_->inbox_mutex);
  impl_->inbox.pressures.push_back(pressure);
}

void RadarInertialOdometry::tune(const Tuning& tuning) {
  const std::lock_guard<std::mutex> lock(impl_->inbox_mutex);
  impl_->inbox.tuning = tuning;
}

std::vector<ScanResult> RadarInertialOdometry::process(std::size_t max_scans) {
  Impl& m = *impl_;
  std::vector<ScanResult> results = m.takeInbox();
  while (results.size() < max_scans) {
    std::optional<RadarScan> scan = m.nextScan(false);
    if (!scan) break;
    results.push_back(m.estimator.useScan(std::move(*scan), false));
  }
  while (m.waiting_scans.size() > m.options.max_queued_scans) {
    ScanResult lost;
    lost.scan = std::move(m.waiting_scans.front());
    lost.rejected_because = "queue_full";
    lost.health = m.estimator.updateHealth();
    m.waiting_scans.erase(m.waiting_scans.begin());
    results.push_back(std::move(lost));
  }
  m.shareStatus();
  return results;
}

std::vector<ScanResult> RadarInertialOdometry::finish() {
  Impl& m = *impl_;
  std::vector<ScanResult> results = process();
  for (ScanResult& last : m.useWaitingScans()) results.push_back(std::move(last));
  m.shareStatus();
  // The poses still in the window belong to the last scan.
  for (const StampedPose& pose : m.estimator.remainingPoses()) {
    if (results.empty()) results.emplace_back();
    results.back().left_window.push_back(pose);
  }
  return results;
}

// Takes the scan that the IMU covered first, also if many IMU samples came at once. So the live node and the
// bag runner use the scans of several radars in the same order.
std::optional<RadarScan> RadarInertialOdometry::Impl::nextScan(bool imu_has_ended) {
  auto first = waiting_scans.end();
  for (auto scan = waiting_scans.begin(); scan != waiting_scans.end(); ++scan) {
    if (!imu_has_ended && estimator.mustWait(*scan)) continue;
    if (first == waiting_scans.end() || estimator.nodeTime(*scan) < estimator.nodeTime(*first)) first = scan;
  }
  if (first == waiting_scans.end()) return std::nullopt;
  std::optional<RadarScan> scan = std::move(*first);
  waiting_scans.erase(first);  // even if the estimator throws
  return scan;
}

std::vector<ScanResult> RadarInertialOdometry::Impl::useWaitingScans() {
  std::vector<ScanResult> results;
  while (std::optional<RadarScan> scan = nextScan(true))
    results.push_back(estimator.useScan(std::move(*scan), true));
  return results;
}

std::vector<ScanResult> RadarInertialOdometry::Impl::takeInbox() {
  std::vector<ScanResult> results;
  Inbox taken;
  {
    const std::lock_guard<std::mutex> lock(inbox_mutex);
    taken.clock_restarts = inbox.clock_restarts;  // keeps its count
    std::swap(taken, inbox);
  }
  if (taken.tuning) estimator.tune(*taken.tuning);
  if (estimator.clockRestarts() != taken.clock_restarts) {
    results = useWaitingScans();  // they belong to the clock before
    estimator.startAgain(taken.clock_restarts);
  }
  const bool scan_came = !taken.scans.empty();
  for (RadarScan& scan : taken.scans) waiting_scans.push_back(std::move(scan));
  estimator.addImu(taken.imu);
  for (const Pressure& pressure : taken.pressures) estimator.addPressure(pressure);
  estimator.keepUp(scan_came, waiting_scans);
  return results;
}

void RadarInertialOdometry::Impl::shareStatus() {
  const Health health = estimator.updateHealth();
  const std::lock_guard<std::mutex> lock(inbox_mutex);
  // If the clock restarted meanwhile, the odometry waits for a new start.
  status.initialized = estimator.initialized() && inbox.clock_restarts == estimator.clockRestarts();
  status.waiting_for = estimator.waitingFor();
  status.health = health;
}

bool RadarInertialOdometry::initialized() const {
  const std::lock_guard<std::mutex> lock(impl_->inbox_mutex);
  return impl_->status.initialized;
}

std::optional<RadarInertialOdometry::Start> RadarInertialOdometry::start() const {
  return impl_->estimator.start();
}

RadarKnowledge RadarInertialOdometry::radarKnowledge(std::size_t radar) const {
  return impl_->estimator.radar(radar).knowledge();
}

MeasuredImuNoise RadarInertialOdometry::imuNoise() const { return impl_->navigation.imuNoise(); }

MeasuredImuNoise RadarInertialOdometry::imuNoiseOfRun() const { return impl_->navigation.imuNoiseOfRun(); }

Health RadarInertialOdometry::health() const {
  const std::lock_guard<std::mutex> lock(impl_->inbox_mutex);
  return impl_->status.health;
}

StartWait RadarInertialOdometry::waitingFor() const {
  const std::lock_guard<std::mutex> lock(impl_->inbox_mutex);
  return impl_->status.waiting_for;
}

std::map<std::string, std::uint64_t> RadarInertialOdometry::faults() const { return impl_->faults.get(); }

}  // namespace rio_t
