#include "tribin/core/parallel.hpp"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <memory>

#include "tribin/core/error.hpp"

namespace tribin {
namespace {

std::unique_ptr<tbb::global_control> g_limit;
int g_threads = 0;

}  // namespace

void set_thread_count(int threads) {
  if (threads < 0) throw Error(ErrorCode::bad_option, "the number of threads must be 0 (all cores) or more");
  g_threads = threads;
  g_limit.reset();
  if (threads > 0)
    g_limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, threads);
}

int thread_count() { return g_threads > 0 ? g_threads : tbb::info::default_concurrency(); }

void parallel_ranges(int count, int grain, const std::function<void(int, int)>& body) {
  TRIBIN_ASSERT(grain > 0);
  const int ranges = (count + grain - 1) / grain;
  parallel_each(ranges, [&](int i) { body(i * grain, std::min(count, (i + 1) * grain)); });
}

void parallel_each(int count, const std::function<void(int)>& body) {
  if (count <= 0) return;
  if (count == 1 || thread_count() == 1) {
    for (int i = 0; i < count; ++i) body(i);
    return;
  }
  // Isolated: a thread that waits for this loop must not start another task of an outer loop in between, which would
  // share its thread-local buffers.
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(
        tbb::blocked_range<int>(0, count, 1),
        [&](const tbb::blocked_range<int>& range) {
          for (int i = range.begin(); i != range.end(); ++i) body(i);
        },
        tbb::simple_partitioner());
  });
}

}  // namespace tribin
