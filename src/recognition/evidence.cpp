#include <Eigen/Cholesky>
#include <cmath>

#include "instance_report.hpp"

namespace tribin {
namespace {

/// Pixels of one primitive, and the normal equations of its own small fit about the instance's pose.
struct Fit {
  // Cylinder: shift along u, v; tilt about u, v; radius. Sphere: shift x, y, z; radius. Plane: offset alone.
  Eigen::Matrix<double, 5, 5> h = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> b = Eigen::Matrix<double, 5, 1>::Zero();
  double squares = 0;
  int pixels = 0;
  double arc_bins[72] = {};
  std::vector<std::int32_t> scan_votes;
};

/// The scan's primitive that most pixels of this fit belong to.
int most_voted(const std::vector<std::int32_t>& votes) {
  int best = 0;
  for (std::size_t i = 1; i < votes.size(); ++i)
    if (votes[i] > (best ? votes[static_cast<std::size_t>(best)] : 0)) best = static_cast<int>(i);
  return best;
}

}  // namespace

void describe_evidence(const Part& part, const SceneDepth& scene, const SceneFeatures& features, Instance& instance) {
  const std::size_t count = part.model.primitives.size();
  std::vector<Fit> fits(count);
  for (Fit& f : fits) f.scan_votes.assign(features.primitives->items.size() + 1, 0);
  const Pose& pose = instance.camera_from_part;
  IndexRender render;
  const int step = step_for(part, scene, pose, 20000);
  render_index(part.render_mesh, scene.camera, pose, step, render);
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const std::int32_t triangle = render.triangle[render.index(i, j)];
      if (triangle < 0) continue;
      const std::int32_t id = part.primitive_of_triangle[static_cast<std::size_t>(triangle)];
      if (id <= 0) continue;
      const int u = render.u0 + i * step, v = render.v0 + j * step;
      const float z = scene.z_mm(u, v);
      if (!(z > 0) || scene.near_break(u, v)) continue;
      const Primitive& p = part.model.primitives[static_cast<std::size_t>(id - 1)];
      Fit& fit = fits[static_cast<std::size_t>(id - 1)];
      const Eigen::Vector3d ray = scene.camera.ray(u, v);
      const Eigen::Vector3d x = ray * z;
      const Eigen::Vector3d a = pose.linear() * Eigen::Vector3d(p.axis), o = pose * Eigen::Vector3d(p.point);
      Eigen::Matrix<double, 5, 1> jac = Eigen::Matrix<double, 5, 1>::Zero();
      double r = 0;
      Eigen::Vector3d n = a;
      if (p.type == PrimitiveType::plane) {
        r = a.dot(x - o);
        jac[0] = 1;
      } else if (p.type == PrimitiveType::cylinder) {
        const Eigen::Vector3d d = x - o;
        const double along = a.dot(d);
        const Eigen::Vector3d across = d - a * along;
        const double distance = across.norm();
        if (distance < 0.1 * p.radius_mm) continue;
        n = across / distance;
        r = distance - p.radius_mm;
        Vec3 eu, ev;
        orthonormal_basis(Vec3(a), eu, ev);
        const double nu = n.dot(Eigen::Vector3d(eu)), nv = n.dot(Eigen::Vector3d(ev));
        jac << nu, nv, along * nu, along * nv, 1;
        const double angle = std::atan2(nv, nu);
        fit.arc_bins[static_cast<int>((angle + kPi) / (2 * kPi) * 72) % 72] += 1;
      } else if (p.type == PrimitiveType::sphere) {
        const Eigen::Vector3d d = x - o;
        n = d.normalized();
        r = d.norm() - p.radius_mm;
        jac << n.x(), n.y(), n.z(), 0, 1;
      } else {  // cone: the distance from its flank, as an offset
        const Eigen::Vector3d d = x - o;
        const double along = a.dot(d);
        const Eigen::Vector3d across = d - a * along;
        if (across.norm() < 1e-6) continue;
        n = across.normalized() * std::cos(p.half_angle) - a * std::sin(p.half_angle);
        r = n.dot(d);
        jac[0] = 1;
      }
      const double slant = std::abs(n.dot(ray));
      const double sigma = std::hypot(scene.sigma_mm(u, v) * slant, part.mesh.chord_error_mm);
      // A measurement free of its nominal value may lie off it: 5 sigma plus 1 % of the part, where a wrong part would
      // show.
      if (std::abs(r) > 5 * sigma + 0.01 * part.diameter_mm) continue;
      const double w = 1 / (sigma * sigma);
      fit.h += w * jac * jac.transpose();
      fit.b += w * jac * r;
      fit.squares += r * r;
      ++fit.pixels;
      if (scene.surfels->surfel_of_cell.contains(u / scene.cell_px, v / scene.cell_px)) {
        const std::int32_t s = scene.surfels->surfel_of_cell(u / scene.cell_px, v / scene.cell_px);
        if (s >= 0) {
          const std::int32_t label = features.primitives->label_of_surfel[static_cast<std::size_t>(s)];
          if (label > 0) ++fit.scan_votes[static_cast<std::size_t>(label)];
        }
      }
    }
  const double inflation = std::max(1.0, correlation_inflation(scene.correlation_px) / (double(step) * step));
  for (std::size_t k = 0; k < count; ++k) {
    const Fit& fit = fits[k];
    if (fit.pixels < 40) continue;  // fewer say nothing of a surface
    const Primitive& p = part.model.primitives[k];
    Evidence e;
    e.type = p.type;
    e.primitive = std::string(name_of(p.type)) + " " + std::to_string(p.id);
    e.cad_primitive = p.id;
    e.scan_primitive = most_voted(fit.scan_votes);
    e.inliers = fit.pixels * step * step;
    e.rms_mm = std::sqrt(fit.squares / fit.pixels);
    if (p.type == PrimitiveType::plane || p.type == PrimitiveType::cone) {
      e.offset_mm = fit.b[0] / fit.h(0, 0);
      e.offset_sigma_mm = std::sqrt(inflation / fit.h(0, 0));
    } else {
      Eigen::Matrix<double, 5, 5> h = fit.h;
      if (p.type == PrimitiveType::sphere) h(3, 3) = 1;
      h.diagonal().array() += 1e-12 * h.trace();
      const Eigen::Matrix<double, 5, 1> x = h.ldlt().solve(fit.b);
      const Eigen::Matrix<double, 5, 5> c = h.inverse();
      e.radius_nominal_mm = p.radius_mm;
      e.radius_measured_mm = p.radius_mm + x[4];
      e.radius_sigma_mm = std::sqrt(std::max(0.0, inflation * c(4, 4)));
      int bins = 0;
      for (const double b : fit.arc_bins) bins += b > 0;
      e.visible_arc = bins * 2 * kPi / 72;
    }
    instance.evidence.push_back(e);
  }
  std::stable_sort(instance.evidence.begin(), instance.evidence.end(),
                   [](const Evidence& a, const Evidence& b) { return a.inliers > b.inliers; });
}

}  // namespace tribin
