#pragma once

#include "tribin/cad/mesh.hpp"

namespace tribin {

/// The mesh with fewer triangles: edges collapsed as long as no surface moves by more than `error_mm`. Flags and names
/// stay; faces and triangles of the original are not kept track of.
/// \source Garland and Heckbert, Surface simplification using quadric error metrics, 1997, as in meshoptimizer.
/// \cost   about 0.4 us a triangle.
Mesh coarse_mesh(const Mesh& mesh, double error_mm);

}  // namespace tribin
