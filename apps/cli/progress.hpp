#pragma once

#include <chrono>
#include <string>

namespace tribin::cli {

/// A line on stderr that says how far long work is. Nothing in a pipe, with -q, or in the first second.
class Progress {
 public:
  Progress(std::string what, int total, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void done(int count);

 private:
  std::string what_;
  int total_;
  bool shown_ = false;
  bool allowed_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace tribin::cli
