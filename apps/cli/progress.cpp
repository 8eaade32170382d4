#include "progress.hpp"

#include <unistd.h>

#include <cstdio>
#include <utility>

namespace tribin::cli {

Progress::Progress(std::string what, int total, bool quiet)
    : what_(std::move(what)), total_(total), allowed_(!quiet && isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (shown_) std::fprintf(stderr, "\r\033[K");
}

void Progress::done(int count) {
  using namespace std::chrono;
  if (!allowed_ || steady_clock::now() - start_ < seconds(1)) return;
  shown_ = true;
  constexpr int kWidth = 32;
  char bar[kWidth + 1];
  for (int i = 0; i < kWidth; ++i) bar[i] = i * total_ < count * kWidth ? '#' : '.';
  bar[kWidth] = 0;
  std::fprintf(stderr, "\r\033[K%s [%s] %d of %d", what_.c_str(), bar, count, total_);
  std::fflush(stderr);
}

}  // namespace tribin::cli
