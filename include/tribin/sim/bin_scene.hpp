#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/core/geometry.hpp"

namespace tribin::sim {

/// An open box: inner floor in z = 0 and centred at the origin, length along x, z up.
struct Bin {
  double length_mm = 460, width_mm = 360, height_mm = 200;  ///< inner
  double wall_mm = 8;                                       ///< of walls and floor
};

/// The bin as a closed mesh.
Mesh bin_mesh(const Bin& bin);

/// A part made ready for physics: distance field, points on its surface, mass properties at uniform density. Make it
/// once for a part; it holds the mesh by reference, which must outlive it.
class Solid {
 public:
  /// \throws Error too_little_data for a mesh without volume, out_of_range for one that would take a field of
  ///               more than 1 GB.
  explicit Solid(const Mesh& mesh);
  ~Solid();
  Solid(Solid&&) noexcept;
  Solid& operator=(Solid&&) noexcept;

  const Mesh& mesh() const;
  /// Of the convex hull [mm^3]: the room that the part takes in a heap.
  double hull_volume_mm3() const;
  double diameter_mm() const;

  struct State;
  const State& state() const { return *state_; }

 private:
  std::unique_ptr<State> state_;
};

/// Parts that have come to rest in a bin.
struct BinFill {
  std::vector<Pose> bin_from_part;  ///< of each part, in the order given
  double top_mm = 0;                ///< highest point of any part
  double wall_contact_mm = 0;       ///< highest point of any part within 2 mm of a wall: the rim must not be lower
  double drift_mm = 0;        ///< of points of parts that were still moving when time was out, in 0.25 s; 0 = none was
  double max_overlap_mm = 0;  ///< deepest that a part's surface lies in another part or in the bin
  double simulated_s = 0;
};

/// Drops parts from above, one after another, each turned and placed by the seed, and lets them come to rest between
/// walls that are as high as needed. Parts collide as they are, holes and hollows included, with friction, at 1/240 s a
/// step. The same bytes for the same parts and seed.
/// \param parts  one entry a body; the same Solid may come more than once.
/// \throws Error out_of_range when a part's diameter is larger than the bin's width.
/// \source       contacts: surface points of each body against the distance field of the other (McNeely et al. 1999);
///               rigid bodies and friction: Bullet's sequential impulses.
BinFill fill_bin(const std::vector<const Solid*>& parts, double length_mm, double width_mm, std::uint64_t seed);

/// How deep the surface of each of two parts lies in the other [mm]: 0 when they are apart. Measured on the triangles,
/// at points 1/200 of the diameter apart.
double overlap_mm(const Solid& a, const Pose& world_from_a, const Solid& b, const Pose& world_from_b);

}  // namespace tribin::sim
