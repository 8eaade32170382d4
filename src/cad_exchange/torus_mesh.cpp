#include "cad_exchange/torus_mesh.hpp"

#include <BRepMesh_Context.hxx>
#include <BRepMesh_DelaunayBaseMeshAlgo.hxx>
#include <BRepMesh_DelaunayNodeInsertionMeshAlgo.hxx>
#include <BRepMesh_FaceDiscret.hxx>
#include <BRepMesh_MeshAlgoFactory.hxx>
#include <BRepMesh_TorusRangeSplitter.hxx>
#include <GCPnts_TangentialDeflection.hxx>
#include <IMeshData_Face.hxx>
#include <algorithm>
#include <cmath>

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

class MeshAlgorithms : public BRepMesh_MeshAlgoFactory {
 public:
  Handle(IMeshTools_MeshAlgo)
      GetAlgo(const GeomAbs_SurfaceType type, const IMeshTools_Parameters& parameters) const override {
    if (type != GeomAbs_Torus) return BRepMesh_MeshAlgoFactory::GetAlgo(type, parameters);
    return new BRepMesh_DelaunayNodeInsertionMeshAlgo<TorusSplitter, BRepMesh_DelaunayBaseMeshAlgo>();
  }
};

}  // namespace

Handle(IMeshTools_Context) mesh_context() {
  Handle(IMeshTools_Context) context = new BRepMesh_Context();
  context->SetFaceDiscret(new BRepMesh_FaceDiscret(new MeshAlgorithms()));
  return context;
}

}  // namespace tribin::detail
