#pragma once

#include <functional>

namespace tribin {

/// Sets how many threads tribin may use from now on, process-wide; 0 = all cores. Never changes a result.
void set_thread_count(int threads);
int thread_count();

/// Calls body(begin, end) on consecutive ranges of [0, count), each `grain` long (the last may be shorter).
/// The ranges are the same for any number of threads, so that partial results can be joined in a fixed order.
void parallel_ranges(int count, int grain, const std::function<void(int begin, int end)>& body);

/// Calls body(i) for each i of [0, count), each its own task: for a few dozens of heavy, independent jobs.
void parallel_each(int count, const std::function<void(int i)>& body);

}  // namespace tribin
