#include <algorithm>
#include <cmath>

#include "metrology.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

/// The scan's primitive that most of the points which hold a fit belong to; 0 = none.
int most_voted(const std::vector<std::int32_t>& labels, const std::vector<bool>& held_by, std::size_t label_count) {
  std::vector<int> votes(label_count + 1, 0);
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (held_by[k] && labels[k] > 0) ++votes[static_cast<std::size_t>(labels[k])];
  const auto most = std::max_element(votes.begin(), votes.end());
  return *most > 0 ? static_cast<int>(most - votes.begin()) : 0;
}

std::int32_t label_at(const SceneDepth& scene, const SceneFeatures& features, int u, int v) {
  const Image<std::int32_t>& cells = scene.surfels->surfel_of_cell;
  if (!cells.contains(u / scene.cell_px, v / scene.cell_px)) return 0;
  const std::int32_t s = cells(u / scene.cell_px, v / scene.cell_px);
  return s < 0 ? 0 : features.primitives->label_of_surfel[static_cast<std::size_t>(s)];
}

double sigma_of(const FreeFit& fit, int k) { return std::sqrt(std::max(0.0, fit.covariance(k, k))); }

}  // namespace

std::vector<double> facet_errors(const Part& part) {
  std::vector<double> out(part.model.primitives.size(), part.mesh.chord_error_mm);
  for (std::size_t t = 0; t < part.primitive_of_triangle.size(); ++t) {
    const int id = part.primitive_of_triangle[t];
    if (id <= 0) continue;
    const Primitive& p = part.model.primitives[static_cast<std::size_t>(id - 1)];
    const auto& corners = part.render_mesh.triangles[t];
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3f middle =
          0.5f * (part.render_mesh.vertices[corners[c]] + part.render_mesh.vertices[corners[(c + 1) % 3]]);
      double& error = out[static_cast<std::size_t>(id - 1)];
      error = std::max(error, std::abs(distance_from(p, middle.cast<double>())));
    }
  }
  return out;
}

std::vector<MeasuredPrimitive> measure_primitives(const Part& part, std::span<const double> facets,
                                                  const SceneDepth& scene, const SceneFeatures& features,
                                                  const PartPixels& pixels, const Instance& instance) {
  const std::size_t count = part.model.primitives.size();
  std::vector<std::vector<SurfacePoint>> points(count);
  std::vector<std::vector<std::int32_t>> labels(count);
  std::vector<std::size_t> mirrored(count, 0);
  const IndexRender& render = pixels.render;
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const std::size_t k = render.index(i, j);
      if (!pixels.inner_primitive[k]) continue;
      const int u = render.u0 + i * pixels.step, v = render.v0 + j * pixels.step;
      const float z = scene.z_mm(u, v);
      if (!(z > 0) || scene.near_break(u, v)) continue;
      // In a hollow all is mirrored; what is round about it holds its radius all the same.
      const Primitive& primitive = part.model.primitives[static_cast<std::size_t>(pixels.primitive(part, k) - 1)];
      if (pixels.mirrored[k] && !is_hollow(primitive)) continue;
      const auto of = static_cast<std::size_t>(pixels.primitive(part, k) - 1);
      mirrored[of] += pixels.mirrored[k];
      points[of].push_back(
          {scene.camera.ray(u, v), z, scene.sigma_mm(u, v), systematic_terms(scene.camera, u, v, z), i, j});
      labels[of].push_back(label_at(scene, features, u, v));
    }
  FreeFitOptions options;
  // A measurement free of its nominal value may lie off it: 1 % of the part, where a wrong part would show.
  options.reach_mm = 0.01 * part.diameter_mm;
  options.independent =
      1 / std::max(1.0, correlation_inflation(scene.correlation_px) / (double(pixels.step) * pixels.step));
  std::vector<MeasuredPrimitive> out;
  for (std::size_t k = 0; k < count; ++k) {
    const Primitive nominal = in_frame(part.model.primitives[k], instance.camera_from_part);
    options.cad_sigma_mm = facets[k];
    auto fit = fit_freely(nominal, points[k], options);
    if (!fit) continue;
    const int scan = most_voted(labels[k], fit->held_by, features.primitives->items.size());
    out.push_back({fit->nominal, std::move(*fit), scan, 2 * mirrored[k] > points[k].size()});
  }
  return out;
}

Evidence evidence_of(const MeasuredPrimitive& m, const PartPixels& pixels, const SystematicVariances& systematic) {
  const Primitive& p = m.fit.measured;
  Evidence e;
  e.type = p.type;
  e.primitive = std::string(name_of(p.type)) + " " + std::to_string(p.id);
  e.cad_primitive = p.id;
  e.scan_primitive = m.scan_primitive;
  e.inliers = p.points * pixels.step * pixels.step;
  e.rms_mm = p.rms_mm;
  if (p.type == PrimitiveType::cylinder || p.type == PrimitiveType::cone) e.visible_arc = p.arc;
  if (p.type == PrimitiveType::plane || p.type == PrimitiveType::cone) {
    // Beside the pose, which has taken what is common to all of the part.
    const Vec3 off = p.point - m.nominal.point;
    e.offset_mm = p.type == PrimitiveType::plane ? m.nominal.axis.dot(off)
                                                 : -std::sin(m.nominal.half_angle) * m.nominal.axis.dot(off);
    e.offset_sigma_mm =
        p.type == PrimitiveType::plane ? sigma_of(m.fit, 2) : std::sin(p.half_angle) * sigma_of(m.fit, 4);
  } else {
    e.radius_nominal_mm = m.nominal.radius_mm;
    if (!p.radius_from_cad) {
      e.radius_measured_mm = p.radius_mm;
      const Eigen::Matrix<double, 1, kSystematicTerms> common = m.fit.response.row(4);
      e.radius_sigma_mm = std::sqrt(
          std::max(0.0, m.fit.covariance(4, 4) + (common * systematic.asDiagonal() * common.transpose()).value()));
    }
  }
  return e;
}

}  // namespace tribin
