#include "publishers.h"

#include <boost/algorithm/string/join.hpp>
#include <set>

namespace rio_t {
namespace {

constexpr std::uint64_t kEnoughMessages = 10, kEnoughTurns = 20;
constexpr std::size_t kMostPublishers = 16;  // bounds the memory: some drivers count messages in the frame_id

}  // namespace

void Publishers::add(const std::string& caller, const std::string& frame) {
  Publisher publisher(caller, frame);
  if (messages_.size() >= kMostPublishers && messages_.count(publisher) == 0) return;
  ++messages_[publisher];
  if (publisher == last_) return;
  ++turns_;
  last_ = std::move(publisher);
}

std::string Publishers::describeSeveral(const std::string& topic) const {
  std::set<std::string> callers, frames, callers_with_frames;
  for (const auto& [publisher, count] : messages_) {
    if (count < kEnoughMessages) continue;
    const auto& [caller, frame] = publisher;
    callers.insert(caller);
    frames.insert("\"" + frame + "\"");
    callers_with_frames.insert(caller + " (frame_id \"" + frame + "\")");
  }
  if (turns_ < kEnoughTurns || callers_with_frames.size() < 2) return "";
  const std::string text =
      callers.size() > 1
          ? std::to_string(callers.size()) +
                " publishers by turns: " + boost::algorithm::join(callers_with_frames, " and ")
          : std::to_string(frames.size()) + " frame_ids by turns, so several nodes publish it: " +
                boost::algorithm::join(frames, " and ");
  return "Topic " + topic + " has messages of " + text + ". rio_t takes them for one sensor.";
}

}  // namespace rio_t
