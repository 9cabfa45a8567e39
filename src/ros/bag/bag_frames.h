#pragma once

#include <map>
#include <string>

#include "bag_file.h"
#include "rio_t/ros/parameters/config.h"

/// Resolves topics by the names in a bag, and frames by its tf.
namespace rio_t {

/// Returns the name of a topic in the bag (`types`: by topic). A relative topic is resolved in the root
/// namespace, as for a live node without a namespace. A bag that was written with relative topics fits, too.
/// A topic that the bag does not have becomes an absolute name; an empty name stays empty.
std::string topicOfBag(const std::string& configured, const std::map<std::string, std::string>& types);

/// Returns the configuration with T_IR from the /tf_static and /tf of the bags for each radar whose
/// extrinsics_source is tf. Throws bagError that names the frames and what is missing.
Config withExtrinsicsOfBag(Config config, const Bags& bags);

}  // namespace rio_t
