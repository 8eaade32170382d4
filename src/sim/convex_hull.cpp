#include "sim/convex_hull.hpp"

#include <LinearMath/btConvexHullComputer.h>

namespace tribin::sim {

std::vector<std::vector<int>> convex_hull(std::span<const Vec3> points) {
  std::vector<std::vector<int>> faces;
  if (points.size() < 4) return faces;
  btConvexHullComputer hull;
  hull.compute(points.front().data(), sizeof(Vec3), static_cast<int>(points.size()), 0, 0);
  for (int f = 0; f < hull.faces.size(); ++f) {
    std::vector<int> face;
    const auto* const first = &hull.edges[hull.faces[f]];
    const auto* edge = first;
    do {
      face.push_back(hull.original_vertex_index[edge->getSourceVertex()]);
      edge = edge->getNextEdgeOfFace();
    } while (edge != first);
    faces.push_back(std::move(face));
  }
  return faces;
}

}  // namespace tribin::sim
