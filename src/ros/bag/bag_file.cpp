#include "bag_file.h"

#include <geometry_msgs/PoseStamped.h>
#include <ros/exception.h>
#include <tf2_eigen/tf2_eigen.h>

#include <boost/algorithm/string/join.hpp>
#include <filesystem>
#include <fstream>
#include <set>
#include <system_error>

#include "../text.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {
namespace {

bool everyTopic(const rosbag::ConnectionInfo* /*connection*/) { return true; }

/// Opens a bag for reading. Throws bagError if that fails.
void openBag(const std::string& path, rosbag::Bag* bag) {
  namespace fs = std::filesystem;
  if (!fs::exists(path))
    throw bagError(
        path, "no such file" + (fs::path(path).is_absolute() ? "" : " in " + fs::current_path().string()));
  if (fs::is_directory(path)) throw bagError(path, "this is a folder, expected a .bag file");
  try {
    bag->open(path, rosbag::bagmode::Read);
  } catch (const rosbag::BagUnindexedException&) {
    throw bagError(path, "not indexed, its recording was cut off; run `rosbag reindex " + path + "` first");
  } catch (const std::exception& error) {
    const std::string magic = "#ROSBAG V2.0";
    std::string start(magic.size(), '\0');
    std::ifstream(path, std::ios::binary).read(start.data(), static_cast<std::streamsize>(start.size()));
    throw bagError(path, std::string("cannot be read as a ROS 1 bag (") + error.what() + ")" +
                             (start == magic ? "; perhaps cut off: try `rosbag reindex " + path + "`" : ""));
  }
}

}  // namespace

std::runtime_error bagError(const std::string& bag, const std::string& what) {
  return std::runtime_error("bag " + bag + ": " + what);
}

std::runtime_error bagError(const std::string& bag, const std::exception& thrown) {
  // rosbag and the reader of messages throw ros::Exception, whose text names neither the file nor the reason.
  const bool is_from_rosbag = dynamic_cast<const ros::Exception*>(&thrown) != nullptr;
  return bagError(
      bag, is_from_rosbag ? std::string("perhaps it is damaged (") + thrown.what() + ")" : thrown.what());
}

void writeBag(const std::string& path, const std::function<void(rosbag::Bag&)>& write) {
  std::unique_ptr<rosbag::Bag> bag;
  const auto discard = [&] {
    if (!bag) return;
    // The bag is leaked on purpose: its destructor would write again, and a failure there would end the
    // program.
    static auto* const discarded = new std::vector<rosbag::Bag*>();
    discarded->push_back(bag.release());
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored)) std::filesystem::remove(path, ignored);
  };
  try {
    bag = std::make_unique<rosbag::Bag>(path, rosbag::bagmode::Write);
    write(*bag);
    bag->close();
  } catch (const rosbag::BagException& error) {
    discard();
    throw std::runtime_error("bag '" + path + "' cannot be written: " + error.what());
  } catch (...) {
    discard();
    throw;
  }
}

Bags::Bags(const std::vector<std::string>& paths) : name_(boost::algorithm::join(paths, ", ")) {
  for (const std::string& path : paths)
    openBag(path, bags_.emplace_back(std::make_unique<rosbag::Bag>()).get());
}

void Bags::addTo(rosbag::View* view, const std::function<bool(const rosbag::ConnectionInfo*)>& query,
                 const ros::Time& begin, const ros::Time& end) const {
  for (const auto& bag : bags_) view->addQuery(*bag, query, begin, end);
}

std::map<std::string, std::string> Bags::typesByTopic() const {
  rosbag::View all;
  addTo(&all, everyTopic);
  std::map<std::string, std::set<std::string>> found;
  for (const rosbag::ConnectionInfo* connection : all.getConnections())
    found[connection->topic].insert(connection->datatype);
  std::map<std::string, std::string> types;
  for (const auto& [topic, of_topic] : found) types[topic] = boost::algorithm::join(of_topic, " and ");
  return types;
}

std::pair<ros::Time, ros::Time> Bags::span() const {
  rosbag::View all;
  addTo(&all, everyTopic);
  if (all.size() == 0) throw bagError(name_, "it holds no messages");
  return {all.getBeginTime(), all.getEndTime()};
}

std::string topicsText(const std::map<std::string, std::string>& types) {
  std::string text;
  for (const auto& [topic, type] : types) appendItem(&text, topic + " (" + type + ")");
  return text.empty() ? "no topics" : text;
}

void checkTopics(const std::string& bag, const std::map<std::string, std::string>& types,
                 const std::vector<InputTopic>& wanted) {
  std::string faults;
  bool missing = false, several_radars = false;
  for (const InputTopic& want : wanted) {
    several_radars = several_radars || want.key.find('/') != std::string::npos;
    const auto found = types.find(want.topic);
    if (found != types.end() && found->second == want.type) continue;
    missing = missing || found == types.end();
    const std::string fault =
        found == types.end()
            ? "no topic " + want.topic + " (" + want.key + ", " + want.type + ")"
            : "topic " + want.topic + " (" + want.key + ") is " + found->second + ", expected " + want.type;
    appendItem(&faults, fault, "; ");
  }
  if (faults.empty()) return;
  if (missing) {
    faults += "; the bag has " + topicsText(types);
    if (several_radars) faults += ". To leave a radar out: --set radars=[NAME of the other]";
  }
  throw bagError(bag, faults);
}

std::pair<ros::Time, ros::Time> playedSpan(const Bags& bags, const Config& config) {
  const auto [first, last] = bags.span();
  const double length = (last - first).toSec();
  if (config.bag_start > length) {
    throw bagError(bags.name(), "bag_start (" + shortText(config.bag_start, 6) + " s) is after its end (" +
                                    shortText(length, 6) + " s)");
  }
  const ros::Time begin = first + ros::Duration(config.bag_start);
  const bool to_end = config.bag_duration <= 0.0 || config.bag_start + config.bag_duration >= length;
  return {begin, to_end ? last : begin + ros::Duration(config.bag_duration)};
}

Trajectory readPoses(const Bags& bags, const std::string& topic) {
  Trajectory truth;
  rosbag::View view;
  bags.addTo(&view, rosbag::TopicQuery(topic));
  for (const rosbag::MessageInstance& instance : view) {
    const auto message = read<geometry_msgs::PoseStamped>(instance);
    StampedPose pose;
    pose.time = toTime(message->header.stamp);
    if (!truth.empty() && pose.time <= truth.back().time) continue;
    tf2::fromMsg(message->pose.position, pose.p_W);
    tf2::fromMsg(message->pose.orientation, pose.q_WI);
    const bool is_finite = pose.p_W.allFinite();
    if (!is_finite || !isUnit(pose.q_WI))
      throw std::runtime_error("the pose of stamp " + formatTime(pose.time) + " has " +
                               (is_finite ? "a quaternion of norm " + std::to_string(pose.q_WI.norm())
                                          : "a position that is not finite") +
                               "; expected finite numbers and a norm of 1");
    pose.q_WI.normalize();
    truth.push_back(pose);
  }
  return truth;
}

}  // namespace rio_t
