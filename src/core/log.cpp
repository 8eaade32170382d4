#include "tribin/core/log.hpp"

#include <mutex>

namespace tribin {
namespace {

std::mutex g_mutex;
std::function<void(LogLevel, const std::string&)> g_sink;

}  // namespace

void set_log_sink(std::function<void(LogLevel, const std::string&)> sink) {
  const std::lock_guard lock(g_mutex);
  g_sink = std::move(sink);
}

void log(LogLevel level, const std::string& message) {
  const std::lock_guard lock(g_mutex);
  if (g_sink) g_sink(level, message);
}

}  // namespace tribin
