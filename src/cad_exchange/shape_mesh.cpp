#include "cad_exchange/shape_mesh.hpp"

#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "cad_exchange/meshing.hpp"
#include "tribin/cad/mend.hpp"

namespace tribin::detail {
namespace {

// A twentieth of the chord error joins the two sides of an edge and is far below any edge that is meant to be there. A
// surface that is that near to a cylinder is one.
double recognition_tolerance(double chord_error_mm) { return chord_error_mm / 20; }

// Chord error over the part's size: below it, a part of metres (or one whose unit is mistaken) would take millions of
// triangles. 2e-5 leaves the default of 0.02 mm alone up to 1 m.
constexpr double kSmallestRelativeChord = 2e-5;
// Above it, a part of a few millimetres would lose its shape.
constexpr double kLargestRelativeChord = 1e-3;

using Triangle = std::array<std::uint32_t, 3>;

/// Joins points that are equal but for rounding: both faces at an edge carry the edge's points.
class Welder {
 public:
  explicit Welder(double tolerance_mm) : tolerance_(tolerance_mm) {}

  /// Index of the first point so far within the tolerance of p, else of p itself, newly added.
  std::uint32_t add(const Vec3& p) {
    const std::array<std::int64_t, 3> c = cell(p);
    for (int i = 0; i < 27; ++i) {
      const auto found = cells_.find(key({c[0] + i % 3 - 1, c[1] + i / 3 % 3 - 1, c[2] + i / 9 - 1}));
      if (found == cells_.end()) continue;
      for (const std::uint32_t k : found->second)
        if ((points_[k] - p).squaredNorm() <= tolerance_ * tolerance_) return k;
    }
    const auto index = static_cast<std::uint32_t>(points_.size());
    points_.push_back(p);
    cells_[key(c)].push_back(index);
    return index;
  }
  const std::vector<Vec3>& points() const { return points_; }

 private:
  std::array<std::int64_t, 3> cell(const Vec3& p) const {
    return {std::llround(p.x() / tolerance_), std::llround(p.y() / tolerance_), std::llround(p.z() / tolerance_)};
  }
  static std::uint64_t key(const std::array<std::int64_t, 3>& c) {
    // Different cells may share a key: the distance decides.
    return static_cast<std::uint64_t>(c[0]) * 0x9E3779B97F4A7C15u ^
           static_cast<std::uint64_t>(c[1]) * 0xC2B2AE3D27D4EB4Fu ^
           static_cast<std::uint64_t>(c[2]) * 0x165667B19E3779F9u;
  }

  double tolerance_;
  std::vector<Vec3> points_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

/// Appends the triangles of one face, outward; false when it could not be meshed.
bool add_face(const TopoDS_Face& face, int id, Welder& welder, Mesh& mesh) {
  TopLoc_Location location;
  const Handle(Poly_Triangulation) triangulation = BRep_Tool::Triangulation(face, location);
  if (triangulation.IsNull()) return false;
  const gp_Trsf transform = location.Transformation();
  std::vector<std::uint32_t> index(triangulation->NbNodes());
  for (int i = 1; i <= triangulation->NbNodes(); ++i) {
    const gp_Pnt p = triangulation->Node(i).Transformed(transform);
    index[i - 1] = welder.add({p.X(), p.Y(), p.Z()});
  }
  const bool flip = (face.Orientation() == TopAbs_REVERSED) != transform.IsNegative();
  for (int i = 1; i <= triangulation->NbTriangles(); ++i) {
    int a, b, c;
    triangulation->Triangle(i).Get(a, b, c);
    if (flip) std::swap(b, c);
    const Triangle t{index[a - 1], index[b - 1], index[c - 1]};
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;  // collapsed at a pole
    mesh.triangles.push_back(t);
    mesh.face_of_triangle.push_back(id);
  }
  return true;
}

double signed_volume(const std::vector<Vec3>& points, const Mesh& mesh, std::size_t first) {
  double volume = 0;
  for (std::size_t i = first; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    volume += points[t[0]].dot(points[t[1]].cross(points[t[2]])) / 6;
  }
  return volume;
}

/// Appends faces; the exact surface of one that has no triangle is kept, so that ids stay the order in the file.
void add_faces(TopExp_Explorer faces, Welder& welder, Mesh& mesh) {
  for (; faces.More(); faces.Next()) {
    const int id = static_cast<int>(mesh.faces.size()) + 1;
    const TopoDS_Face& face = TopoDS::Face(faces.Current());
    mesh.faces.push_back(exact_face(face, id, recognition_tolerance(mesh.chord_error_mm)));
    if (!add_face(face, id, welder, mesh))
      mesh.warnings.push_back("face " + std::to_string(id) + " could not be meshed and is left out");
  }
}

/// Faces of one solid, outward.
void add_solid(const TopoDS_Shape& solid, Welder& welder, Mesh& mesh) {
  const std::size_t first = mesh.triangles.size();
  add_faces(TopExp_Explorer(solid, TopAbs_FACE), welder, mesh);
  if (signed_volume(welder.points(), mesh, first) >= 0) return;
  for (std::size_t i = first; i < mesh.triangles.size(); ++i) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
  mesh.warnings.push_back("a solid was inside out and has been turned");
}

}  // namespace

Mesh mesh_of_shape(const TopoDS_Shape& shape, const TessellationOptions& options) {
  Mesh mesh;
  mesh.chord_error_mm = options.chord_error_mm;
  Bnd_Box box;
  BRepBndLib::AddClose(shape, box);
  const double diagonal = box.IsVoid() ? 0 : std::sqrt(box.SquareExtent());
  if (diagonal > 0) mesh.chord_error_mm = std::min(mesh.chord_error_mm, kLargestRelativeChord * diagonal);
  if (kSmallestRelativeChord * diagonal > mesh.chord_error_mm) {
    mesh.chord_error_mm = kSmallestRelativeChord * diagonal;
    mesh.warnings.push_back("the part is " + std::to_string(std::lround(diagonal)) +
                            " mm across, so its chord error is raised to " + std::to_string(mesh.chord_error_mm) +
                            " mm");
  }
  // One thread: the same triangles in the same order on every machine.
  BRepMesh_IncrementalMesh mesher;
  mesher.SetShape(shape);
  mesher.ChangeParameters().Deflection = mesh.chord_error_mm;
  mesher.ChangeParameters().Angle = options.angle;
  mesher.ChangeParameters().InParallel = false;
  mesher.Perform(mesh_context(recognition_tolerance(mesh.chord_error_mm)));
  Welder welder(recognition_tolerance(mesh.chord_error_mm));
  for (TopExp_Explorer solids(shape, TopAbs_SOLID); solids.More(); solids.Next())
    add_solid(solids.Current(), welder, mesh);
  const std::size_t of_solids = mesh.triangles.size();
  add_faces(TopExp_Explorer(shape, TopAbs_FACE, TopAbs_SOLID), welder, mesh);
  mesh.vertices.reserve(welder.points().size());
  for (const Vec3& p : welder.points()) mesh.vertices.push_back(p.cast<float>());
  // Faces outside of all solids say nothing sure of their side: the triangles' winding is mended as any mesh's.
  if (mesh.triangles.size() > of_solids) mend_mesh(mesh);
  take_sides_of_triangles(mesh);
  return mesh;
}

}  // namespace tribin::detail
