#pragma once

#include <string>
#include <vector>

#include "report/png.hpp"
#include "tribin/report/page_kit.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin::report {

/// Decimals so that the last one stands where the sigma's first digit is.
int decimals_for(double sigma);

std::string type_icon(PrimitiveType type);

/// A picture for light and dark pages, inline: the same pixels under two palettes.
std::string picture(const Image<std::uint8_t>& indices, const std::vector<Rgb>& light, const std::vector<Rgb>& dark,
                    const std::string& alt);

/// A dot on a rail of +-3 sigma.
std::string sigma_rail(double in_sigmas);

/// SHA-256 of a file, as hex.
/// \throws Error bad_input when it cannot be read.
std::string sha256_of_file(const std::string& path);

}  // namespace tribin::report
