#pragma once

#include <functional>
#include <string>

namespace tribin {

enum class LogLevel { debug, info, warning };

/// The one sink of the library's messages; none is set at start, so the library is silent.
void set_log_sink(std::function<void(LogLevel, const std::string&)> sink);
void log(LogLevel level, const std::string& message);

}  // namespace tribin
