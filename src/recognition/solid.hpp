#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "tribin/core/box_tree.hpp"
#include "tribin/core/geometry.hpp"

namespace tribin {

/// A closed surface as a body that others cannot enter. Part frame, mm.
class Solid {
 public:
  /// \param triangles  wound outward.
  Solid(std::span<const Vec3f> vertices, std::span<const std::array<std::uint32_t, 3>> triangles);

  /// The way out of the solid for a point of another body's surface.
  struct Depth {
    double mm = 0;                 ///< > 0
    Vec3 outward = Vec3::UnitZ();  ///< unit
  };
  /// How deep a point lies inside, from the nearest face that looks against `normal`, as two faces that touch do. None
  /// outside, and where no face looks so.
  /// \param normal  unit, outward, of the other body's surface at the point.
  std::optional<Depth> depth(const Vec3& point, const Vec3& normal) const;

  const Vec3& low() const { return tree_.nodes.front().low; }
  const Vec3& high() const { return tree_.nodes.front().high; }

 private:
  bool inside(const Vec3& point) const;

  std::vector<std::array<Vec3, 3>> triangles_;  ///< corner a, sides ab, ac
  BoxTree<Vec3> tree_;
};

}  // namespace tribin
