#pragma once

#include <cstdint>

namespace rio_t::bench {

/// Allocations on the heap by this process so far; in programs that link count_allocations.cpp.
std::uint64_t allocations();

}  // namespace rio_t::bench
