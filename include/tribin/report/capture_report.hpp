#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "tribin/capture/triangulate.hpp"

namespace tribin {

/// "measured 57.0 %, dark 25.1 %, ...": the shares of the reasons, in the order of Invalid, without those that are 0.
std::string describe_validity(const Image<std::uint8_t>& invalid_reason);

/// Writes index.html with pictures of the projector column (phase), modulation and validity of each camera, and of the
/// scan's validity and depth. No network, one page. \throws Error bad_option when the folder cannot be written.
void write_capture_report(const std::filesystem::path& folder, const Triangulated& result,
                          std::span<const Decoded> cameras);

}  // namespace tribin
