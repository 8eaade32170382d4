#include <algorithm>
#include <cmath>
#include <numeric>

#include "segmentation/boundary.hpp"
#include "segmentation/cad_faces.hpp"
#include "segmentation/consensus.hpp"
#include "segmentation/fillets.hpp"
#include "segmentation/loose_points.hpp"
#include "segmentation/mesh_growth.hpp"
#include "segmentation/spaces.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin {
namespace {

using namespace segmentation_detail;

Limits limits_of(const Surfels& surfels, const Scene& scene, const SegmentationOptions& options) {
  // The least that holds a plane's or a cylinder's direction; loose points have the whole of a cell's say each.
  const double kCells = surfels.point_set != nullptr ? 10 : 30;
  Limits limits;
  limits.radii_mm = options.radii_mm;
  for (double radius : limits.radii_mm)
    if (!(radius > 0))
      throw Error(ErrorCode::bad_option, "a radius of " + std::to_string(radius) + " mm was asked for");
  std::sort(limits.radii_mm.begin(), limits.radii_mm.end());
  const bool cad = surfels.mesh != nullptr;
  const double cell = scene.cell_mm * scene.cell_mm;
  double total = 0;
  for (float area : surfels.area_mm2) total += area;
  // On CAD, facets of fillets and of lettering are no primitives; a screw hole in a housing has 5e-4 of its area.
  const double least = cad ? 2e-4 * total : kCells * cell;
  limits.min_area_mm2 = options.min_area_mm2 > 0 ? options.min_area_mm2 : least;
  limits.min_surfels = cad ? 1 : std::max<std::size_t>(8, static_cast<std::size_t>(0.5 * limits.min_area_mm2 / cell));
  // Surfels call "ruled" what bends by more than half of 1 / max_radius of their options: twice the default of 100 mm.
  limits.max_radius_mm = 250;
  if (cad) {  // exact corners tell any radius that the part has room for
    Vec3f low = surfels.position[0], high = low;
    for (const Vec3f& p : surfels.position) low = low.cwiseMin(p), high = high.cwiseMax(p);
    limits.max_radius_mm = std::max<double>(limits.max_radius_mm, (high - low).norm());
  }
  for (double radius : limits.radii_mm) limits.max_radius_mm = std::max(limits.max_radius_mm, 1.5 * radius);
  return limits;
}

/// Area of the surfels' normals in IJK space, for people to look at.
void fill_ijk(const Surfels& s, HoughSpaces& spaces) {
  const DirectionBins& bins = ijk_bins();
  spaces.ijk_all.assign(bins.center.size(), 0.0f);
  spaces.ijk_flat = spaces.ijk_curved = spaces.ijk_all;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const int bin = bins.find(s.normal[i]);
    spaces.ijk_all[bin] += s.area_mm2[i];
    if (s.shape[i] == SurfelShape::flat) spaces.ijk_flat[bin] += s.area_mm2[i];
    if (s.shape[i] == SurfelShape::ruled) spaces.ijk_curved[bin] += s.area_mm2[i];
  }
}

double rms_mm(const Surfels& s, const Indices& support, const Surface& surface) {
  double squares = 0;
  for (std::uint32_t i : support) squares += std::pow(misfit(s, i, surface), 2);
  return std::sqrt(squares / static_cast<double>(support.size()));
}

Primitive primitive_of(const Surfels& s, FoundSurface& found) {
  const Surface& surface = found.fit.surface;
  Primitive p;
  p.type = surface.type;
  p.axis = surface.axis;
  p.point = surface.point;
  p.concave = surface.concave;
  p.arc = found.arc;
  p.radius_from_cad = found.radius_from_cad;
  p.covariance = found.fit.covariance;
  p.peak = found.peak;
  p.surfels = found.support;
  p.area_mm2 = area_of(s, found.support);
  p.rms_mm = rms_mm(s, found.support, surface);
  for (std::uint32_t i : found.support) p.points += static_cast<int>(s.points[i]);
  if (p.type == PrimitiveType::plane) {
    p.offset_mm = p.axis.dot(p.point);
    return p;
  }
  p.radius_mm = surface.radius;
  p.minor_radius_mm = surface.minor_radius;
  if (p.type == PrimitiveType::sphere || p.type == PrimitiveType::torus) return p;
  if (p.type == PrimitiveType::cylinder && p.axis.z() < 0) p.axis = -p.axis;
  if (p.type == PrimitiveType::cone) {
    if (surface.half_angle < 0) p.axis = -p.axis;  // from the apex into the cone
    p.half_angle = std::abs(surface.half_angle);
    p.point -= p.axis * (surface.radius / std::tan(p.half_angle));
    p.radius_mm = 0;
  }
  p.extent_min = 1e300;
  p.extent_max = -1e300;
  for (std::uint32_t i : found.support) {
    Vec3 raw[3];
    const int count = raw_points(s, i, raw);
    for (int k = 0; k < count; ++k) {
      const double t = p.axis.dot(raw[k] - p.point);
      p.extent_min = std::min(p.extent_min, t);
      p.extent_max = std::max(p.extent_max, t);
    }
  }
  if (p.type == PrimitiveType::cylinder) {
    const double middle = 0.5 * (p.extent_min + p.extent_max);
    p.point += p.axis * middle;
    p.extent_min -= middle;
    p.extent_max -= middle;
  }
  return p;
}

}  // namespace

const char* name_of(PrimitiveType type) {
  constexpr const char* kNames[] = {"plane", "cylinder", "cone", "sphere", "torus"};
  return kNames[static_cast<int>(type)];
}

void segmentation_detail::explain(Scene& scene, const Limits& limits, HoughSpaces& spaces,
                                  std::vector<FoundSurface>& found) {
  if (scene.surfels.mesh != nullptr) {
    // Corners are exact, so one round is enough: planes that their outline proves, round surfaces, other planes.
    fill_parameter_space(scene, spaces);
    if (!scene.surfels.mesh->faces.empty()) return;  // a B-rep says itself what it consists of; the rest is free form
    find_planes(scene, limits, PlaneVoters::flat, spaces, found);
    find_round_on_mesh(scene, limits, found);
    find_planes(scene, limits, PlaneVoters::flat_and_undecided, spaces, found);
    return;
  }
  // Back and forth among the spaces on what is left, until a round explains nothing more.
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds; ++round) {
    const std::size_t before = found.size();
    find_planes(scene, limits, PlaneVoters::flat, spaces, found);
    find_cylinders(scene, limits, spaces, found);
    find_planes(scene, limits, PlaneVoters::flat_and_undecided, spaces, found);
    find_cones_and_spheres(scene, limits, found);
    if (found.size() == before) break;
  }
  find_by_great_circles(scene, limits, spaces, found);
}

Primitives segment(const Surfels& given, const SegmentationOptions& options) {
  Primitives out;
  const Scene whole(given);
  const Limits limits = limits_of(given, whole, options);
  const bool points_alone = given.point_set != nullptr && noise_shows(whole);
  const Surfels surer = points_alone ? with_common_noise(given, limits) : Surfels();
  const Surfels& surfels = points_alone ? surer : given;
  Scene scene(surfels);
  fill_ijk(surfels, out.spaces);

  std::vector<FoundSurface> found;
  if (surfels.mesh != nullptr) take_cad_faces(scene, found);

  if (points_alone) explain_by_consensus(scene, limits, found);
  if (!points_alone) explain(scene, limits, out.spaces, found);
  if (surfels.point_set != nullptr && !points_alone) explain_rest(scene, limits, out.spaces, found);

  if (surfels.mesh == nullptr && !points_alone) merge_pieces(scene, found);

  // Supports in order of their surfels, by one pass over the labels; then the largest first.
  for (FoundSurface& f : found) f.support.clear();
  for (std::uint32_t i = 0; i < scene.label.size(); ++i)
    if (scene.label[i] > 0) found[static_cast<std::size_t>(scene.label[i] - 1)].support.push_back(i);
  std::erase_if(found, [](const FoundSurface& f) { return f.support.empty(); });
  out.items.resize(found.size());
  parallel_each(static_cast<int>(found.size()), [&](int i) {
    FoundSurface& f = found[static_cast<std::size_t>(i)];
    if (surfels.mesh == nullptr && !points_alone && f.fit.surface.type != PrimitiveType::plane) polish(scene, f);
    out.items[static_cast<std::size_t>(i)] = primitive_of(surfels, f);
  });
  std::stable_sort(out.items.begin(), out.items.end(),
                   [](const Primitive& a, const Primitive& b) { return a.area_mm2 > b.area_mm2; });
  if (surfels.scan != nullptr && options.boundaries) {
    parallel_each(static_cast<int>(out.items.size()), [&](int i) {
      Primitive& p = out.items[static_cast<std::size_t>(i)];
      if (p.type == PrimitiveType::plane) p.loops = plane_boundaries(p, surfels);
    });
    add_common_holes(out.items, surfels);
  }
  out.label_of_surfel.assign(surfels.size(), 0);
  for (std::size_t i = 0; i < out.items.size(); ++i) {
    out.items[i].id = static_cast<int>(i + 1);
    for (std::uint32_t k : out.items[i].surfels) out.label_of_surfel[k] = out.items[i].id;
  }
  mark_fillets(out, surfels);
  return out;
}

}  // namespace tribin
