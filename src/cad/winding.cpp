#include "cad/winding.hpp"

#include <algorithm>
#include <cmath>

#include "cad/triangle_tree.hpp"
#include "tribin/cad/half_edges.hpp"
#include "tribin/cad/measure.hpp"

namespace tribin {
namespace {

/// The neighbour over each of a triangle's edges, or none; and whether the two run the edge the same way (a mistake).
struct Neighbours {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::array<std::uint32_t, 3> triangle{kNone, kNone, kNone};
  std::array<bool, 3> against{false, false, false};
};

void link(std::vector<Neighbours>& neighbours, const HalfEdge& a, const HalfEdge& b) {
  const auto add = [&](std::uint32_t from, std::uint32_t to) {
    Neighbours& n = neighbours[from];
    for (int i = 0; i < 3; ++i) {
      if (n.triangle[i] != Neighbours::kNone) continue;
      n.triangle[i] = to;
      n.against[i] = a.forward == b.forward;
      return;
    }
  };
  add(a.triangle, b.triangle);
  add(b.triangle, a.triangle);
}

/// Links triangles over the edges that have just two; edges of more are left, where shells may touch.
std::vector<Neighbours> neighbours_of(const Mesh& mesh, std::vector<int>& open, MendReport& report) {
  std::vector<Neighbours> neighbours(mesh.triangles.size());
  open.assign(mesh.triangles.size(), 0);
  for_each_edge(sorted_half_edges(mesh.triangles), [&](std::span<const HalfEdge> edge) {
    if (edge.size() == 2) return link(neighbours, edge[0], edge[1]);
    (edge.size() == 1 ? report.boundary_edges : report.junction_edges) += 1;
    for (const HalfEdge& half : edge) ++open[half.triangle];
  });
  return neighbours;
}

struct Shell {
  std::vector<std::uint32_t> triangles;
  double area = 0;
  bool closed = true;    ///< but for cracks
  bool twisted = false;  ///< has one side only, or edges that contradict each other
};

void flip(Mesh& mesh, std::uint32_t triangle) { std::swap(mesh.triangles[triangle][1], mesh.triangles[triangle][2]); }

Vec3 area_vector(const Mesh& mesh, std::uint32_t i) {
  const auto& t = mesh.triangles[i];
  const Vec3 a = mesh.vertices[t[0]].cast<double>();
  const Vec3 ab = Vec3(mesh.vertices[t[1]].cast<double>()) - a, ac = Vec3(mesh.vertices[t[2]].cast<double>()) - a;
  return 0.5 * ab.cross(ac);
}

/// Gathers the shell of a triangle and makes it consistent, as the larger part of its area is wound in the file.
Shell gather_shell(Mesh& mesh, const std::vector<Neighbours>& neighbours, const std::vector<int>& open,
                   std::uint32_t seed, std::vector<signed char>& state) {
  Shell shell;
  double turned_area = 0;
  std::size_t open_edges = 0;
  state[seed] = 1;  // 1 as in the file, -1 turned, 0 not seen yet
  shell.triangles.push_back(seed);
  for (std::size_t at = 0; at < shell.triangles.size(); ++at) {
    const std::uint32_t i = shell.triangles[at];
    const double area = area_vector(mesh, i).norm();
    shell.area += area;
    if (state[i] < 0) turned_area += area;
    open_edges += open[i];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t other = neighbours[i].triangle[k];
      if (other == Neighbours::kNone) continue;
      const auto wanted = static_cast<signed char>(neighbours[i].against[k] ? -state[i] : state[i]);
      if (state[other] == 0) {
        state[other] = wanted;
        shell.triangles.push_back(other);
      } else if (state[other] != wanted) {
        shell.twisted = true;
      }
    }
  }
  const signed char turn = turned_area > 0.5 * shell.area ? 1 : -1;
  for (std::uint32_t i : shell.triangles) {
    if (state[i] == turn) flip(mesh, i);
  }
  // Cracks of a few edges do not open a shell; a hole does: the area vectors of a closed surface sum to zero.
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t i : shell.triangles) sum += area_vector(mesh, i);
  shell.closed = !shell.twisted && open_edges <= 0.01 * static_cast<double>(shell.triangles.size()) &&
                 sum.norm() <= 0.01 * shell.area;
  return shell;
}

/// Calls visit(triangle, centre, normal) at some dozens of places spread evenly over the shell's area.
template <class Visit>
void visit_places(const Mesh& mesh, const Shell& shell, Visit visit) {
  constexpr int kPlaces = 33;
  double passed = 0;
  int place = 0;
  for (std::uint32_t i : shell.triangles) {
    const Vec3 vector = area_vector(mesh, i);
    passed += vector.norm();
    if (place >= kPlaces || passed * kPlaces < (place + 0.5) * shell.area || vector.norm() == 0) continue;
    while (place < kPlaces && passed * kPlaces >= (place + 0.5) * shell.area) ++place;
    const auto& t = mesh.triangles[i];
    const Vec3 sum =
        mesh.vertices[t[0]].cast<double>() + mesh.vertices[t[1]].cast<double>() + mesh.vertices[t[2]].cast<double>();
    visit(i, Vec3(sum / 3.0), Vec3(vector.normalized()));
  }
}

// Slopes of rays against the normal, without any symmetry that would send them along edges and through vertices.
constexpr double kSlopes[3][2] = {{0.1317, 0.0713}, {-0.2371, 0.1511}, {0.0579, -0.3093}};

Vec3 aside(const Vec3& normal, const double (&slope)[2]) {
  Vec3 u, v;
  orthonormal_basis(normal, u, v);
  return slope[0] * u + slope[1] * v;
}

/// Which way an open shell is wound: outward (1), inward (-1), cannot be told (0). Rays go to both sides; the outside
/// is where a ray crosses an even number of triangles, the inside where it is odd.
int vote(const Mesh& mesh, const Shell& shell, const TriangleTree& tree) {
  int outward = 0, inward = 0, rays = 0;
  std::vector<std::uint32_t> crossed;
  visit_places(mesh, shell, [&](std::uint32_t triangle, const Vec3& center, const Vec3& normal) {
    const auto odd = [&](const Vec3& direction) {
      tree.cross(center, direction, crossed);
      return (crossed.size() - std::count(crossed.begin(), crossed.end(), triangle)) % 2 == 1;
    };
    for (const auto& slope : kSlopes) {
      const bool front = odd(normal + aside(normal, slope)), back = odd(aside(normal, slope) - normal);
      outward += !front && back;
      inward += front && !back;
      ++rays;
    }
  });
  // A plate or a patch has no inside: hardly any ray has one odd and one even side then.
  if (outward > 2 * inward && 5 * outward > rays) return 1;
  if (inward > 2 * outward && 5 * inward > rays) return -1;
  return 0;
}

double volume(const Mesh& mesh, const Shell& shell) {
  const Vec3 origin = mesh.vertices[mesh.triangles[shell.triangles[0]][0]].cast<double>();
  double sum = 0;
  for (std::uint32_t i : shell.triangles) {
    const auto& t = mesh.triangles[i];
    sum += (Vec3(mesh.vertices[t[0]].cast<double>()) - origin).dot(area_vector(mesh, i)) / 3;
  }
  return sum;
}

/// Whether a closed shell, wound outward, lies in the material of the others: then it is a cavity and faces its hollow.
/// Rays start a little inside of it, so that solids of an assembly that touch are not taken for one in the other.
bool is_cavity(const Mesh& mesh, const Shell& shell, const TriangleTree& tree, std::uint32_t number,
               const std::vector<std::uint32_t>& closed_shell_of) {
  const double step = 1e-4 * std::sqrt(shell.area);
  int inside = 0, rays = 0;
  std::vector<std::uint32_t> crossed;
  visit_places(mesh, shell, [&](std::uint32_t, const Vec3& center, const Vec3& normal) {
    for (const auto& slope : kSlopes) {
      tree.cross(center - step * normal, aside(normal, slope) - normal, crossed);
      int others = 0;
      for (std::uint32_t i : crossed) others += closed_shell_of[i] != 0 && closed_shell_of[i] != number;
      inside += others % 2;
      ++rays;
    }
  });
  return inside > 0.9 * rays;  // a solid that only overlaps another stays a solid
}

}  // namespace

void mend_winding(Mesh& mesh, MendReport& report) {
  const std::vector<std::array<std::uint32_t, 3>> before = mesh.triangles;
  std::vector<int> open;
  const std::vector<Neighbours> neighbours = neighbours_of(mesh, open, report);
  std::vector<signed char> state(mesh.triangles.size(), 0);
  std::vector<Shell> shells;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (state[i] == 0) shells.push_back(gather_shell(mesh, neighbours, open, i, state));
  }
  report.shells = static_cast<int>(shells.size());
  double area = 0, unoriented_area = 0;
  for (const Shell& shell : shells) area += shell.area;
  std::vector<std::uint32_t> closed_shell_of(mesh.triangles.size(), 0);  // number from 1; 0 = of an open shell
  for (std::size_t n = 0; n < shells.size(); ++n) {
    if (!shells[n].closed) continue;
    for (std::uint32_t i : shells[n].triangles) closed_shell_of[i] = static_cast<std::uint32_t>(n + 1);
    if (volume(mesh, shells[n]) < 0) {
      for (std::uint32_t i : shells[n].triangles) flip(mesh, i);
    }
  }
  if (shells.size() > 1 || !shells[0].closed) {
    const TriangleTree tree(mesh);
    for (std::size_t n = 0; n < shells.size(); ++n) {
      const Shell& shell = shells[n];
      const auto number = static_cast<std::uint32_t>(n + 1);
      const int side = shell.closed    ? (is_cavity(mesh, shell, tree, number, closed_shell_of) ? -1 : 1)
                       : shell.twisted ? 0
                                       : vote(mesh, shell, tree);
      if (side < 0) {
        for (std::uint32_t i : shell.triangles) flip(mesh, i);
      } else if (side == 0) {
        ++report.unoriented_shells;
        unoriented_area += shell.area;
      }
    }
  }
  for (std::size_t i = 0; i < before.size(); ++i) report.flipped += before[i] != mesh.triangles[i];
  mesh.oriented = unoriented_area <= 0.01 * area;  // crumbs of a bad file do not make the whole part two-sided
}

}  // namespace tribin
