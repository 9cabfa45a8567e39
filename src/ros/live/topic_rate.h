#pragma once

#include <diagnostic_updater/diagnostic_updater.h>

#include <functional>
#include <string>

namespace rio_t {

/// Makes a task of /diagnostics: how often a topic comes. Silence is an error, any rate is right. What it
/// returns is to be called for each message, by any thread. `updater` must live longer.
std::function<void()> topicRate(const std::string& topic, diagnostic_updater::Updater& updater);

}  // namespace rio_t
