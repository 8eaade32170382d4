#pragma once

#include "segmentation/spaces.hpp"

namespace tribin::segmentation_detail {

/// Exact primitives straight from a B-rep: one per surface, faces of one surface that touch (a cylinder is split into
/// two faces in most files) joined. Labels the triangles; free-form faces stay free for the spaces.
void take_cad_faces(Scene& scene, std::vector<FoundSurface>& found);

}  // namespace tribin::segmentation_detail
