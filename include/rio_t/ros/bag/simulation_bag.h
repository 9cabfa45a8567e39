#pragma once

#include <string>

#include "rio_t/simulation/simulation.h"

namespace rio_t {

/// Whose bag is imitated: topics, fields, axes and stamps.
enum class BagFormat {
  kIrs,       ///< IRS / RIO data sets: stamped scans in RIO axes (x right, y forward, z up)
  kTiMmwave,  ///< ti_mmwave_rospkg: scans without stamp, x forward, y left, z up; `seq` pairs scan and
              ///< trigger
};

struct SimulationBagOptions {
  BagFormat format = BagFormat::kIrs;
  double ground_truth_rate = 50.0;  ///< [Hz]
  double record_offset = 0.0;       ///< [s] clock of the recorder minus clock of the IMU
};

/// Writes what the sensors measured on `motion` to the bag `path`, in the order of arrival; record times are
/// arrival times, nothing of the writing machine enters, so the same data gives the same bytes.
///
/// Both formats: /sensor_platform/imu, /ground_truth/pose (PoseStamped of I in W), /ground_truth/twist
/// (TwistStamped, linear and angular velocity both in W). IRS: /sensor_platform/radar/scan and
/// /sensor_platform/radar/trigger. ti_mmwave: /ti_mmwave/radar_scan_pcl and
/// /sensor_platform/radar_right/trigger. Lost scans keep their trigger.
///
/// With a barometer, both: /sensor_platform/baro (FluidPressure in Pa, variance unknown).
///
/// Radars with names, IRS: /sensor_platform/radar_NAME/scan and /sensor_platform/radar_NAME/trigger, both in
/// the frame radar_NAME. ti_mmwave: /ti_mmwave/radar_scan_pcl_NAME, without frame as that driver leaves it,
/// and /sensor_platform/radar_NAME/trigger in the frame radar_NAME.
///
/// Throws std::runtime_error naming the file if it cannot be written.
void writeSimulationBag(const std::string& path, const simulation::Motion& motion,
                        const simulation::SensorData& data, Time start, const SimulationBagOptions& options);

}  // namespace rio_t
