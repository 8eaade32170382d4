#pragma once

#include <functional>

#include "report/sighting.hpp"

namespace tribin::report {

/// The primitives of a sighting as clean surfaces, each trimmed to where its pixels lie; gaps of a few pixels are
/// closed, holes stay holes.
/// \param label  the primitive of a pixel, or null.
ShadedSurface patches_of(const Scan& scan, const Sighting& where,
                         const std::function<const Primitive*(int u, int v)>& label);

}  // namespace tribin::report
