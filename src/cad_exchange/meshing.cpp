#include "cad_exchange/meshing.hpp"

#include <BRepMesh_Context.hxx>
#include <BRepMesh_DelaunayBaseMeshAlgo.hxx>
#include <BRepMesh_DelaunayNodeInsertionMeshAlgo.hxx>
#include <BRepMesh_FaceDiscret.hxx>
#include <BRepMesh_MeshAlgoFactory.hxx>
#include <BRepMesh_TorusRangeSplitter.hxx>
#include <BRep_Tool.hxx>
#include <GCPnts_TangentialDeflection.hxx>
#include <IMeshData_Face.hxx>
#include <Poly_Triangulation.hxx>
#include <algorithm>
#include <cmath>

#include "cad_exchange/shape_mesh.hpp"

namespace tribin::detail {
namespace {

class TorusSplitter : public BRepMesh_TorusRangeSplitter {
 public:
  Handle(IMeshData::ListOfPnt2d) GenerateSurfaceNodes(const IMeshTools_Parameters& parameters) const override {
    const gp_Torus torus = GetDFace()->GetSurface()->Torus();
    const double deflection = GetDFace()->GetDeflection();
    const auto steps = [&](double radius, double range) {
      const double step =
          GCPnts_TangentialDeflection::ArcAngularStep(radius, deflection, parameters.Angle, parameters.MinSize);
      return std::max(2, static_cast<int>(std::ceil(range / step)));
    };
    const auto [u0, u1] = GetRangeU();
    const auto [v0, v1] = GetRangeV();
    // The outer equator is the longest way round, so that its step holds the chord error everywhere.
    const int nu = steps(torus.MajorRadius() + torus.MinorRadius(), u1 - u0), nv = steps(torus.MinorRadius(), v1 - v0);
    const Handle(NCollection_IncAllocator) allocator = new NCollection_IncAllocator(IMeshData::MEMORY_BLOCK_SIZE_HUGE);
    const Handle(IMeshData::ListOfPnt2d) nodes = new IMeshData::ListOfPnt2d(allocator);
    for (int i = 0; i < nu; ++i)  // half a step off the rims' points, as in a strip of even triangles
      for (int j = 1; j < nv; ++j) nodes->Append(gp_Pnt2d(u0 + (u1 - u0) * (i + 0.5) / nu, v0 + (v1 - v0) * j / nv));
    return nodes;
  }
};

bool has_straight_lines(const CadFace& face) {
  return face.type == SurfaceType::plane || face.type == SurfaceType::cylinder || face.type == SurfaceType::cone;
}

/// Are the middles of all triangles within `limit` of the surface that the face was taken for?
bool is_near(const TopoDS_Face& face, const CadFace& known, double limit) {
  TopLoc_Location location;
  const Handle(Poly_Triangulation) triangles = BRep_Tool::Triangulation(face, location);
  if (triangles.IsNull()) return false;
  for (int i = 1; i <= triangles->NbTriangles(); ++i) {
    int corner[3];
    triangles->Triangle(i).Get(corner[0], corner[1], corner[2]);
    Vec3 middle = Vec3::Zero();
    for (const int k : corner) {
      const gp_Pnt p = triangles->Node(k).Transformed(location.Transformation());
      middle += Vec3(p.X(), p.Y(), p.Z()) / 3.0;
    }
    if (distance_to(known, middle) > limit) return false;
  }
  return true;
}

/// Meshes by the points of the boundary alone where these hold the chord error, else as Open CASCADE does.
class StraightAlgorithm : public IMeshTools_MeshAlgo {
 public:
  StraightAlgorithm(Handle(IMeshTools_MeshAlgo) boundary, Handle(IMeshTools_MeshAlgo) refining, double tolerance)
      : boundary_(std::move(boundary)), refining_(std::move(refining)), tolerance_(tolerance) {}

  void Perform(const IMeshData::IFaceHandle& face, const IMeshTools_Parameters& parameters,
               const Message_ProgressRange& range) override {
    const TopoDS_Face& shape = face->GetFace();
    const CadFace known = exact_face(shape, 0, tolerance_);
    if (has_straight_lines(known)) {
      IMeshTools_Parameters without = parameters;
      without.ControlSurfaceDeflection = false;
      boundary_->Perform(face, without, range);
      if (is_near(shape, known, 1.2 * face->GetDeflection())) return;  // 1.2: edges were cut by the same chord error
    }
    refining_->Perform(face, parameters, range);
  }

 private:
  Handle(IMeshTools_MeshAlgo) boundary_, refining_;
  double tolerance_;
};

class MeshAlgorithms : public BRepMesh_MeshAlgoFactory {
 public:
  explicit MeshAlgorithms(double tolerance) : tolerance_(tolerance) {}

  Handle(IMeshTools_MeshAlgo)
      GetAlgo(const GeomAbs_SurfaceType type, const IMeshTools_Parameters& parameters) const override {
    const auto usual = [&] { return BRepMesh_MeshAlgoFactory::GetAlgo(type, parameters); };
    switch (type) {
      case GeomAbs_Torus:
        return new BRepMesh_DelaunayNodeInsertionMeshAlgo<TorusSplitter, BRepMesh_DelaunayBaseMeshAlgo>();
      case GeomAbs_Plane:
      case GeomAbs_Cylinder:
      case GeomAbs_Cone:
      case GeomAbs_Sphere:
        return usual();
      default:
        return new StraightAlgorithm(usual(), usual(), tolerance_);
    }
  }

 private:
  double tolerance_;
};

}  // namespace

Handle(IMeshTools_Context) mesh_context(double tolerance) {
  Handle(IMeshTools_Context) context = new BRepMesh_Context();
  context->SetFaceDiscret(new BRepMesh_FaceDiscret(new MeshAlgorithms(tolerance)));
  return context;
}

}  // namespace tribin::detail
