#pragma once

#include <string>

namespace parts {

/// A STEP file's text with each point, direction, vector and axis written once, where Open CASCADE's writer repeats it
/// for every edge; the time stamp of the header is fixed, so that each run writes the same bytes.
std::string compact_step(const std::string& text);

}  // namespace parts
