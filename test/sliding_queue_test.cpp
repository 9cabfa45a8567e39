#include "rio_t/core/sliding_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

namespace rio_t {
namespace {

TEST(SlidingQueue, DoesAsADequeDoes) {
  SlidingQueue<int> queue;
  std::deque<int> expected;
  // Longer and shorter, and empty once in a while.
  for (int i = 0; i < 2000; ++i) {
    const bool shrinks = i % 100 > 40;
    if (!shrinks || !expected.empty()) {
      if (shrinks) {
        queue.pop_front();
        expected.pop_front();
      } else {
        queue.push_back(i);
        expected.push_back(i);
      }
    }
    ASSERT_EQ(queue.size(), expected.size());
    ASSERT_EQ(queue.empty(), expected.empty());
    ASSERT_TRUE(std::equal(queue.begin(), queue.end(), expected.begin(), expected.end())) << "step " << i;
    if (expected.empty()) continue;
    ASSERT_EQ(queue.front(), expected.front());
    ASSERT_EQ(queue.back(), expected.back());
    ASSERT_EQ(queue[expected.size() / 2], expected[expected.size() / 2]);
  }
  queue.clear();
  EXPECT_TRUE(queue.empty());
}

TEST(SlidingQueue, KeepsItsMemory) {
  SlidingQueue<int> queue;
  for (int i = 0; i < 10; ++i) queue.push_back(i);
  for (int i = 0; i < 30; ++i) {
    queue.push_back(i);
    queue.pop_front();
  }
  const int* lowest = queue.begin();
  const int* highest = queue.end();
  for (int i = 0; i < 1000; ++i) {
    queue.push_back(i);
    queue.pop_front();
    lowest = std::min(lowest, queue.begin());
    highest = std::max(highest, queue.end());
  }
  EXPECT_LE(highest - lowest, 4 * 10);
}

}  // namespace
}  // namespace rio_t
