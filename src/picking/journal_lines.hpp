#pragma once

#include <string>

#include "tribin/picking/journal.hpp"

namespace tribin::picking {

/// One line, without its end.
std::string line_of(const Entry& entry);

}  // namespace tribin::picking
