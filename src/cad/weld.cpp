#include <algorithm>
#include <bit>
#include <cmath>

#include "tribin/cad/mend.hpp"

namespace tribin {
namespace {

/// A hash table of cells with chained vertices; cells are a little larger than twice the tolerance, so that a vertex
/// has to look into few of them.
class CellTable {
 public:
  explicit CellTable(std::size_t items) : heads_(std::bit_ceil(2 * items + 1), kNone), next_(items, kNone) {}

  static constexpr std::uint32_t kNone = 0xffffffffu;

  std::uint32_t first(const std::array<std::int64_t, 3>& cell) const { return heads_[slot(cell)]; }
  std::uint32_t next(std::uint32_t item) const { return next_[item]; }
  void insert(const std::array<std::int64_t, 3>& cell, std::uint32_t item) {
    std::uint32_t& head = heads_[slot(cell)];
    next_[item] = head;
    head = item;
  }

 private:
  std::size_t slot(const std::array<std::int64_t, 3>& cell) const {
    std::uint64_t h = 0;
    for (std::int64_t c : cell) {
      h = (h ^ static_cast<std::uint64_t>(c)) * 0x9e3779b97f4a7c15ull;  // 2^64 / golden ratio
      h ^= h >> 29;
    }
    return h & (heads_.size() - 1);
  }

  std::vector<std::uint32_t> heads_;
  std::vector<std::uint32_t> next_;
};

/// Which earlier vertex each vertex becomes; its own number where it stays.
std::vector<std::uint32_t> representatives(const std::vector<Vec3f>& vertices, double tolerance) {
  std::vector<std::uint32_t> same(vertices.size());
  CellTable table(vertices.size());
  const double inverse = tolerance > 0 ? 1 / (8 * tolerance) : 0;
  const auto cell_of = [&](double value) {
    if (inverse > 0) return static_cast<std::int64_t>(std::floor(value * inverse));
    return std::bit_cast<std::int64_t>(value + 0.0);  // exact: -0 is 0
  };
  const double squared = tolerance * tolerance;
  for (std::uint32_t i = 0; i < vertices.size(); ++i) {
    const Vec3 p = vertices[i].cast<double>();
    std::array<std::int64_t, 3> low, high, own;
    for (int c = 0; c < 3; ++c) {
      low[c] = cell_of(p[c] - tolerance);
      own[c] = cell_of(p[c]);
      high[c] = cell_of(p[c] + tolerance);
    }
    std::uint32_t best = i;
    for (int corner = 0; corner < 8; ++corner) {
      std::array<std::int64_t, 3> cell;
      bool repeated = false;
      for (int c = 0; c < 3; ++c) {
        const bool upper = corner >> c & 1;
        cell[c] = upper ? high[c] : low[c];
        repeated |= upper && low[c] == high[c];
      }
      if (repeated) continue;
      for (std::uint32_t k = table.first(cell); k != CellTable::kNone; k = table.next(k)) {
        if (k < best && (vertices[k].cast<double>() - p).squaredNorm() <= squared) best = k;
      }
    }
    same[i] = best;
    if (best == i) table.insert(own, i);
  }
  return same;
}

}  // namespace

std::size_t weld_vertices(Mesh& mesh, double tolerance_mm) {
  const std::vector<std::uint32_t> same = representatives(mesh.vertices, tolerance_mm);
  std::size_t joined = 0;
  for (std::uint32_t i = 0; i < same.size(); ++i) joined += same[i] != i;
  std::vector<std::uint32_t> number(mesh.vertices.size(), CellTable::kNone);
  std::vector<Vec3f> kept;
  kept.reserve(mesh.vertices.size() - joined);
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& corner : triangle) {
      const std::uint32_t representative = same[corner];
      if (number[representative] == CellTable::kNone) {
        number[representative] = static_cast<std::uint32_t>(kept.size());
        kept.push_back(mesh.vertices[representative]);
      }
      corner = number[representative];
    }
  }
  mesh.vertices = std::move(kept);
  return joined;
}

}  // namespace tribin
