#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "report/json_values.hpp"
#include "tribin/report/json.hpp"

namespace tribin {
namespace {

using json::Json;

Json matrix4(const Pose& pose) {
  Json out = Json::array();
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) out.push_back(json::rounded(pose.matrix()(i, j), 9));
  return out;
}

Json symmetry_json(const SymmetryGroup& symmetry) {
  Json out = {{"symmetries_continuous", Json::array()}, {"symmetries_discrete", Json::array()}};
  for (const ContinuousSymmetry& s : symmetry.continuous)
    out["symmetries_continuous"].push_back(
        {{"axis", json::unit_vector(s.axis)}, {"offset", json::millimetres(s.point)}});
  for (std::size_t i = 1; i < symmetry.discrete.size(); ++i)  // BOP leaves the identity out
    out["symmetries_discrete"].push_back(matrix4(symmetry.discrete[i]));
  return out;
}

// A camera to speak of: white noise of 0.1 mm a pixel, 0.5 mm a pixel. A direction whose sigma is above one pixel's own
// noise is held by next to nothing: it is called weak.
constexpr double kNoiseMm = 0.1, kPixelMm = 0.5;

struct ViewStrength {
  double sigma_mm = 0;                ///< along the weakest direction; turns count at the rim, half a diameter out
  Vector6 weakest = Vector6::Zero();  ///< (mm, mm at the rim), part frame, about the box's centre
};

/// How well the surface seen from one direction holds the pose, point to plane; depth edges, which add to it, are not
/// counted, and what turns freely by symmetry is left out.
ViewStrength strength_of(const Part& part, const PartView& view) {
  const double rim = std::max(1e-9, 0.5 * part.diameter_mm);
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    const Vec3 n = view.normals[i].cast<double>(), arm = view.points[i].cast<double>() - part.box_center();
    Eigen::Matrix<double, 6, 1> j;
    j << n, arm.cross(n) / rim;
    information += j * j.transpose();
  }
  const double pixels = view.area_mm2 / (kPixelMm * kPixelMm);
  if (!view.points.empty()) information *= pixels / view.points.size() / (kNoiseMm * kNoiseMm);
  for (const ContinuousSymmetry& s : part.symmetry.continuous) {
    Eigen::Matrix<double, 6, 1> turn;  // what the free turn does to the centre of the box, and the turn itself
    turn << s.axis.cross(part.box_center() - s.point), s.axis * rim;
    turn.normalize();
    information += turn * turn.transpose() * (information.trace() + 1);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(information);
  ViewStrength out;
  out.sigma_mm = 1 / std::sqrt(std::max(eigen.eigenvalues()[0], 1e-12));
  out.weakest = eigen.eigenvectors().col(0);
  return out;
}

/// What fixes each degree of freedom: of the whole surface's information (point to plane, each patch weighted by how
/// much of it the views see), the share that each primitive gives. The rest lies on free-form surface.
Json degrees_of_freedom(const Part& part) {
  const char* const names[6] = {"shift along x", "shift along y", "shift along z",
                                "turn about x",  "turn about y",  "turn about z"};
  const Mesh& mesh = part.mesh;
  std::vector<Vector6> share(part.model.primitives.size() + 1, Vector6::Zero());  // place 0: no primitive
  Vector6 all = Vector6::Zero();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto id = static_cast<std::size_t>(part.primitive_of_triangle[t]);
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3 p = mesh.vertices[a].cast<double>(), q = mesh.vertices[b].cast<double>(),
               r = mesh.vertices[c].cast<double>(), cross = (q - p).cross(r - p);
    if (!(cross.norm() > 0)) continue;
    const Vec3 n = cross.normalized(), arm = (p + q + r) / 3 - part.box_center();
    double weight = 0.5 * cross.norm();
    if (id > 0) weight *= part.exposed_mm2[id - 1] / std::max(part.model.primitives[id - 1].area_mm2, 1e-9);
    Vector6 j;
    j << n, arm.cross(n);
    share[id] += weight * j.cwiseAbs2();
    all += weight * j.cwiseAbs2();
  }
  constexpr double kWorthNaming = 0.05;
  Json out = Json::array();
  for (int k = 0; k < 6; ++k) {
    std::vector<std::pair<double, std::size_t>> by;
    for (std::size_t id = 1; id < share.size(); ++id)
      if (share[id][k] > kWorthNaming * all[k]) by.emplace_back(-share[id][k] / all[k], id);
    std::sort(by.begin(), by.end());
    Json fixed = Json::array();
    for (const auto& [minus_share, id] : by)
      fixed.push_back({{"primitive", id}, {"share", json::rounded(-minus_share, 3)}});
    out.push_back({{"motion", names[k]}, {"fixed_by", fixed}});
  }
  return out;
}

Json findability_json(const Part& part) {
  std::vector<double> sigmas;
  Json weak = Json::array();
  for (const PartView& view : part.views) {
    const ViewStrength strength = strength_of(part, view);
    sigmas.push_back(strength.sigma_mm);
    if (strength.sigma_mm <= kNoiseMm) continue;
    Json direction = Json::array();
    for (int i = 0; i < 6; ++i) direction.push_back(json::rounded(strength.weakest[i], 4));
    weak.push_back({{"from", json::unit_vector(view.direction)},
                    {"sigma_mm", json::significant(std::min(strength.sigma_mm, 1e6))},
                    {"direction", direction}});
  }
  std::sort(sigmas.begin(), sigmas.end());
  Json out = {{"noise_mm", kNoiseMm}, {"pixel_mm", kPixelMm}, {"views", part.views.size()}};
  if (!sigmas.empty()) {
    out["median_sigma_mm"] = json::significant(sigmas[sigmas.size() / 2]);
    out["worst_sigma_mm"] = json::significant(std::min(sigmas.back(), 1e6));
  }
  out["degrees_of_freedom"] = degrees_of_freedom(part);
  out["weak_views"] = weak;
  return out;
}

}  // namespace

std::string part_json(const Part& part, const std::string& file, const StageTimes& times, const JsonOptions& options) {
  Json out = json::head();
  out["part"] = part.name;
  out["file"] = file;
  out["triangles"] = part.mesh.triangles.size();
  out["oriented"] = part.mesh.oriented;
  out["box_mm"] = {{"min", json::millimetres(part.box_min)}, {"max", json::millimetres(part.box_max)}};
  out["diameter_mm"] = json::millimetres(part.diameter_mm);
  out["area_mm2"] = json::rounded(part.area_mm2, 2);
  out["primitives"] = Json::array();
  for (const Primitive& primitive : part.model.primitives) {
    Json entry = json::primitive(primitive, nullptr);
    entry.erase("covariance");
    out["primitives"].push_back(entry);
  }
  out["relations"] = Json::array();
  for (const Relation& relation : part.model.relations)
    out["relations"].push_back(json::relation(relation, Pose::Identity()));
  out["symmetry"] = symmetry_json(part.symmetry);
  out["self_similar"] = Json::array();
  for (const SelfSimilarPose& pose : part.self_similar) {
    Json points = Json::array();
    for (const Vec3f& p : pose.discriminating_points) points.push_back(json::millimetres(Vec3(p.cast<double>())));
    out["self_similar"].push_back({{"part_from_part", json::pose(pose.part_from_part)},
                                   {"overlap", json::rounded(pose.overlap, 4)},
                                   {"discriminating_points_mm", points}});
  }
  out["findability"] = findability_json(part);
  out["warnings"] = json::warnings({}, part.warnings);
  if (options.times) out["stages_ms"] = json::stages(times);
  return json::text_of(out);
}

}  // namespace tribin
