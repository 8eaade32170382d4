#pragma once

#include <cstdint>

#include "tribin/core/image.hpp"

namespace tribin::sim {

/// Noise of sd 1 over an image: white noise filtered by a Gaussian of sd `correlation_px`, scaled to sd 1.
Image<float> noise_field(int width, int height, double correlation_px, std::uint64_t seed);

}  // namespace tribin::sim
