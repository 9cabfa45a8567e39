#include "rio_t/ros/bag/simulation_bag.h"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TwistStamped.h>
#include <rosbag/bag.h>
#include <sensor_msgs/FluidPressure.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bag_file.h"
#include "rio_t/ros/messages/conversions.h"
#include "rio_t/simulation/sample_count.h"

namespace rio_t {
namespace {

using simulation::SimulatedPoint;
using simulation::SimulatedScan;

constexpr double kImuLatency = 0.001;        // [s] from stamp to arrival, also of the triggers
constexpr double kBarometerLatency = 0.002;  // [s] likewise

struct Layout {
  std::string scan_topic;
  std::string trigger_topic;
  std::string scan_frame;
  std::string trigger_frame;
  bool scan_stamped;
  double orientation_covariance;  // first element in the IMU message; -1 says "no orientation"
  std::vector<std::pair<std::string, std::uint32_t>> fields;  // name and offset [byte], all float32
  std::uint32_t point_step;                                   // [byte]
  // Values in the order of `fields`.
  std::vector<float> (*values)(const SimulatedPoint&);
};

std::vector<float> irsValues(const SimulatedPoint& p) {
  const Eigen::Vector3f position_R = p.position_R.cast<float>();
  return {position_R.x(),
          position_R.y(),
          position_R.z(),
          static_cast<float>(p.snr_db),
          static_cast<float>(p.doppler),
          static_cast<float>(p.noise_db),
          static_cast<float>(p.position_R.norm())};
}

std::vector<float> tiMmwaveValues(const SimulatedPoint& p) {
  const Eigen::Vector3f position_R = p.position_R.cast<float>();
  // x forward, y left, z up
  return {position_R.y(), -position_R.x(), position_R.z(), static_cast<float>(p.snr_db),
          static_cast<float>(p.doppler)};
}

// With the topics and the frames of a single radar.
Layout layoutOf(BagFormat format) {
  if (format == BagFormat::kTiMmwave) {
    return {"/ti_mmwave/radar_scan_pcl",
            "/sensor_platform/radar_right/trigger",
            "",
            "PB4",
            false,
            0.0,
            {{"x", 0}, {"y", 4}, {"z", 8}, {"intensity", 16}, {"velocity", 20}},
            32,
            tiMmwaveValues};
  }
  return {
      "/sensor_platform/radar/scan",
      "/sensor_platform/radar/trigger",
      "radar",
      "radar",
      true,
      -1.0,
      {{"x", 0}, {"y", 4}, {"z", 8}, {"snr_db", 12}, {"v_doppler_mps", 16}, {"noise_db", 20}, {"range", 24}},
      28,
      irsValues};
}

// With the topics and the frames of a radar that has a name.
Layout layoutOf(BagFormat format, const std::string& name) {
  Layout layout = layoutOf(format);
  const std::string radar = "radar_" + name;
  layout.trigger_topic = "/sensor_platform/" + radar + "/trigger";
  layout.trigger_frame = radar;
  if (format == BagFormat::kTiMmwave) {
    layout.scan_topic += "_" + name;
  } else {
    layout.scan_topic = "/sensor_platform/" + radar + "/scan";
    layout.scan_frame = radar;
  }
  return layout;
}

struct RadarTrack {
  const std::vector<SimulatedScan>* scans;
  Layout layout;
};

std::vector<RadarTrack> tracksOf(const simulation::SensorData& data, BagFormat format) {
  if (data.radars.empty()) return {{&data.scans, layoutOf(format)}};
  std::vector<RadarTrack> tracks;
  for (const auto& [name, scans] : data.radars) tracks.push_back({&scans, layoutOf(format, name)});
  return tracks;
}

sensor_msgs::Imu imuMessage(const ImuMeasurement& sample, std::uint32_t seq, double orientation_covariance) {
  sensor_msgs::Imu message;
  message.header = toHeader(sample.time, "base_link", seq);
  message.orientation_covariance[0] = orientation_covariance;
  tf2::toMsg(sample.angular_velocity, message.angular_velocity);
  tf2::toMsg(sample.acceleration, message.linear_acceleration);
  return message;
}

sensor_msgs::FluidPressure pressureMessage(const simulation::SimulatedPressure& sample, std::uint32_t seq) {
  sensor_msgs::FluidPressure message;
  message.header = toHeader(sample.stamp, "base_link", seq);
  message.fluid_pressure = sample.pascal;
  return message;
}

sensor_msgs::PointCloud2 scanMessage(const SimulatedScan& scan, const Layout& layout) {
  sensor_msgs::PointCloud2 message;
  message.header.seq = scan.seq;
  if (layout.scan_stamped) message.header.stamp = toRosTime(scan.stamp);
  message.header.frame_id = layout.scan_frame;
  message.height = 1;
  message.width = static_cast<std::uint32_t>(scan.points.size());
  for (const auto& [name, offset] : layout.fields) {
    sensor_msgs::PointField field;
    field.name = name;
    field.offset = offset;
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    message.fields.push_back(field);
  }
  message.is_bigendian = 0;
  message.point_step = layout.point_step;
  message.row_step = message.point_step * message.width;
  message.is_dense = 1;
  message.data.assign(message.row_step, 0);
  std::uint8_t* point_data = message.data.data();
  for (const SimulatedPoint& point : scan.points) {
    const std::vector<float> values = layout.values(point);
    for (std::size_t f = 0; f < values.size(); ++f) {
      std::memcpy(point_data + layout.fields[f].second, &values[f], sizeof(float));
    }
    point_data += layout.point_step;
  }
  return message;
}

geometry_msgs::PoseStamped poseMessage(const simulation::MotionState& state, Time time, std::uint32_t seq) {
  geometry_msgs::PoseStamped message;
  message.header = toHeader(time, "world", seq);
  message.pose.position = tf2::toMsg(state.p_W);
  message.pose.orientation = tf2::toMsg(state.q_WI);
  return message;
}

geometry_msgs::TwistStamped twistMessage(const simulation::MotionState& state, Time time, std::uint32_t seq) {
  geometry_msgs::TwistStamped message;
  message.header = toHeader(time, "world", seq);
  tf2::toMsg(state.v_W, message.twist.linear);
  tf2::toMsg(state.q_WI * state.omega_I, message.twist.angular);
  return message;
}

// A message that arrives at the recorder, and how to write it.
struct Arrival {
  Time time;
  std::function<void(rosbag::Bag& bag, const ros::Time& record)> write;
};

std::vector<Arrival> arrivals(const simulation::Motion& motion, const simulation::SensorData& data,
                              const std::vector<RadarTrack>& radars, Time start,
                              const SimulationBagOptions& options) {
  std::vector<Arrival> all;
  const auto add = [&all](Time time, const std::string& topic, auto make) {
    all.push_back({time, [topic, make](rosbag::Bag& bag, const ros::Time& record) {
                     bag.write(topic, record, make());
                   }});
  };
  const auto truths =
      static_cast<std::uint32_t>(std::floor(motion.duration() * options.ground_truth_rate)) + 1;
  for (std::uint32_t i = 0; i < truths; ++i) {
    const Time time = start + i / options.ground_truth_rate;
    add(time, "/ground_truth/pose",
        [&motion, time, start, i] { return poseMessage(motion.at(time - start), time, i); });
    add(time, "/ground_truth/twist",
        [&motion, time, start, i] { return twistMessage(motion.at(time - start), time, i); });
  }
  const double orientation_covariance = layoutOf(options.format).orientation_covariance;
  std::uint32_t seq = 0;
  for (const ImuMeasurement& sample : data.imu.samples)
    add(sample.time + kImuLatency, "/sensor_platform/imu", [&sample, seq = seq++, orientation_covariance] {
      return imuMessage(sample, seq, orientation_covariance);
    });
  seq = 0;
  for (const simulation::SimulatedPressure& sample : data.pressures)
    add(sample.stamp + kBarometerLatency, "/sensor_platform/baro",
        [&sample, seq = seq++] { return pressureMessage(sample, seq); });
  for (const RadarTrack& radar : radars) {
    const Layout& layout = radar.layout;
    for (const SimulatedScan& scan : *radar.scans) {
      add(scan.stamp + kImuLatency, layout.trigger_topic,
          [&scan, &layout] { return toHeader(scan.stamp, layout.trigger_frame, scan.seq); });
      if (scan.delivered)
        add(scan.arrival, layout.scan_topic, [&scan, &layout] { return scanMessage(scan, layout); });
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Arrival& a, const Arrival& b) { return a.time < b.time; });
  return all;
}

}  // namespace

void writeSimulationBag(const std::string& path, const simulation::Motion& motion,
                        const simulation::SensorData& data, Time start, const SimulationBagOptions& options) {
  if (!(options.ground_truth_rate > 0.0)) throw std::invalid_argument("ground truth: rate must be positive");
  simulation::checkSampleCount("ground-truth-rate", options.ground_truth_rate, motion.duration());
  const std::vector<RadarTrack> radars = tracksOf(data, options.format);
  writeBag(path, [&](rosbag::Bag& bag) {
    for (const Arrival& arrival : arrivals(motion, data, radars, start, options))
      arrival.write(bag, toRosTime(arrival.time + options.record_offset));
  });
}

}  // namespace rio_t
