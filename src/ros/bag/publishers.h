#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace rio_t {

/// Counts who publishes on one topic of a bag. Two nodes on one topic look like one sensor that jumps.
class Publishers {
 public:
  /// Counts a message. `caller`: the node, if the bag names it; `frame`: the frame_id of its header.
  void add(const std::string& caller, const std::string& frame);
  /// Returns a sentence that names the publishers if there are several, else nothing. Their messages must
  /// alternate: a node that starts again under another name, or one message among many, is no second
  /// publisher.
  std::string describeSeveral(const std::string& topic) const;

 private:
  using Publisher = std::pair<std::string, std::string>;  // caller, frame
  std::map<Publisher, std::uint64_t> messages_;
  Publisher last_;
  std::uint64_t turns_ = 0;
};

}  // namespace rio_t
