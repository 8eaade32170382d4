#include "tribin/core/error.hpp"

namespace tribin {

void assertion_failed(const char* condition, const char* file, int line) {
  throw Error(ErrorCode::internal, std::string(file) + ":" + std::to_string(line) + ": broken contract: " + condition +
                                       ". Please report this.");
}

}  // namespace tribin
