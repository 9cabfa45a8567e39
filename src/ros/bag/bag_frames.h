#pragma once

#include <map>
#include <string>

#include "bag_file.h"
#include "rio_t/ros/parameters/config.h"

/// Names that a bag resolves: topics, and frames by its tf.
namespace rio_t {

/// A topic as the bag has it (`types`: by topic). A relative topic is resolved as in the root namespace, so
/// it is the topic that the live node hears without a namespace; a bag that was written with relative topics
/// fits, too. What the bag does not have stays, as an absolute name; no name stays none.
std::string topicOfBag(const std::string& configured, const std::map<std::string, std::string>& types);

/// With T_IR of the radars whose extrinsics_source is tf, from the /tf_static and /tf of the bags. Throws
/// bagError that names the frames and what is missing.
Config withExtrinsicsOfBag(Config config, const Bags& bags);

}  // namespace rio_t
