#pragma once

#include <stdexcept>
#include <string>

namespace tribin {

/// Stable numbers: the exit codes of the program and the codes of the service.
enum class ErrorCode : int {
  bad_option = 2,       ///< a bad option, or a component that is not built in
  bad_input = 3,        ///< a file that cannot be read as what it claims to be
  too_little_data = 4,  ///< readable, but not enough in it to work on
  out_of_range = 5,     ///< a value outside of what makes sense (a unit mistaken, mostly)
  device = 6,           ///< a camera, a robot or a network that does not answer as it should
  time_limit = 7,       ///< the time ran out before anything could be given out
  internal = 70,        ///< a fault of tribin itself
};

/// An expected failure. The message names the file and the place in it, what was seen and what was wanted.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

}  // namespace tribin

/// A broken contract inside tribin: checked in every build.
#define TRIBIN_ASSERT(condition)                                                  \
  do {                                                                            \
    if (!(condition)) ::tribin::assertion_failed(#condition, __FILE__, __LINE__); \
  } while (false)

namespace tribin {
/// \throws Error internal, naming the condition and the place.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);
}  // namespace tribin
