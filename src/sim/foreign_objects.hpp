#pragma once

#include <vector>

#include "tribin/cad/mesh.hpp"

namespace tribin::sim {

/// Things that lie among the parts and are none of them: a block, a round bar, a tube, a hexagon, an angle. Their
/// longest side is 0.5 to 0.9 times `size_mm`.
std::vector<Mesh> foreign_objects(double size_mm);

}  // namespace tribin::sim
