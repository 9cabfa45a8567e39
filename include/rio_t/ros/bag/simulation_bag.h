#pragma once

#include <string>

#include "rio_t/simulation/simulation.h"

namespace rio_t {

/// The bag has the topics, fields, axes and stamps of this data set or driver.
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

/// Writes the data of the sensors and the truth of `motion` to a bag, in the order of arrival. The record
/// times are the times of arrival, so the same data give the same bytes.
///
/// Both formats: /sensor_platform/imu, /ground_truth/pose (PoseStamped of I in W), /ground_truth/twist
/// (TwistStamped, linear and angular velocity both in W). IRS: /sensor_platform/radar/scan and
/// /sensor_platform/radar/trigger. ti_mmwave: /ti_mmwave/radar_scan_pcl and
/// /sensor_platform/radar_right/trigger. A lost scan keeps its trigger.
///
/// With a barometer, both: /sensor_platform/baro (FluidPressure in Pa, variance unknown).
///
/// Radars with names, IRS: /sensor_platform/radar_NAME/scan and /sensor_platform/radar_NAME/trigger, both in
/// the frame radar_NAME. ti_mmwave: /ti_mmwave/radar_scan_pcl_NAME, without frame as that driver leaves it,
/// and /sensor_platform/radar_NAME/trigger in the frame radar_NAME.
///
/// Throws std::runtime_error that names the file if it cannot be written.
void writeSimulationBag(const std::string& path, const simulation::Motion& motion,
                        const simulation::SensorData& data, Time start, const SimulationBagOptions& options);

}  // namespace rio_t
