#include "tribin/finder/finder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tribin/config/work_cell.hpp"
#include "tribin/core/error.hpp"
#include "tribin/paper_method/recognize.hpp"
#include "tribin/recognition/recognize.hpp"

namespace tribin {
namespace {

/// Radii of the parts' cylinders and spheres, sorted, each once.
std::vector<double> radii_of(std::span<const Part> parts) {
  std::vector<double> radii;
  for (const Part& part : parts)
    for (const Primitive& p : part.model.primitives)
      if (p.type == PrimitiveType::cylinder || p.type == PrimitiveType::sphere) radii.push_back(p.radius_mm);
  std::sort(radii.begin(), radii.end());
  radii.erase(std::unique(radii.begin(), radii.end(), [](double a, double b) { return b - a < 1e-3 * b; }),
              radii.end());
  return radii;
}

void check_size(const Scan& scan, const Part& part, std::vector<Warning>& warnings) {
  double lo[3] = {1e30, 1e30, 1e30}, hi[3] = {-1e30, -1e30, -1e30};
  for (int v = 0; v < scan.height(); v += 8)
    for (int u = 0; u < scan.width(); u += 8) {
      if (!(scan.z_mm(u, v) > 0)) continue;
      const Vec3 p = scan.point(u, v);
      for (int i = 0; i < 3; ++i) {
        lo[i] = std::min(lo[i], p[i]);
        hi[i] = std::max(hi[i], p[i]);
      }
    }
  const double extent = std::hypot(hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]);
  const double ratio = part.diameter_mm / extent;
  if (ratio >= 0.01 && ratio <= 20) {
    if (ratio < 0.02 || ratio > 2)
      warnings.push_back({"part_size", part.name + " is " + std::to_string(part.diameter_mm) +
                                           " mm across in a scan of " + std::to_string(extent) +
                                           " mm: is the CAD's unit right?"});
    return;
  }
  const char* unit = ratio < 0.01 ? (ratio * 1000 < 20 && ratio * 1000 > 0.01 ? "m" : "inch") : "mm";
  throw Error(ErrorCode::out_of_range,
              part.name + ": the part is " + std::to_string(part.diameter_mm) + " mm across, the scan " +
                  std::to_string(extent) +
                  " mm; a part of 1 % to 20 times the scan is wanted. Is the CAD in another unit? Try --unit " + unit +
                  ".");
}

std::string with(const char* format, double a, double b, double c) {
  char text[240];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

void warn_of_bin(const BinSighting& bin, std::vector<Warning>& warnings) {
  if (!bin.found) {
    warnings.push_back(
        {"bin_not_found", "the bin is not found, and nothing of it is taken out of the scan: " + bin.reason});
  } else if (bin.drift_sigma && *bin.drift_sigma > kDriftLimit) {
    warnings.push_back({"calibration_drift",
                        with("the bin is seen %.2f mm and %.2f deg from where it is said to stand, %.1f sigmas: it was "
                             "moved, or the hand-eye calibration has drifted",
                             bin.drift_mm, bin.drift_rad / kDegree, *bin.drift_sigma)});
  }
}

}  // namespace

KnownBin known_bin(const WorkCell& cell, const Scan& scan) {
  TRIBIN_ASSERT(cell.bin.has_value());
  KnownBin out;
  out.shape = {cell.bin->inner_size_mm, cell.bin->wall_mm};
  out.sigma_mm = cell.hand_eye.sigma_mm;
  out.sigma_rad = cell.hand_eye.sigma_rad;
  const Pose base_from_input = base_from_camera(cell, scan.taken, scan.source);
  const Pose camera_from_bin = (base_from_input * scan.input_from_camera).inverse() * cell.bin->base_from_bin;
  // Both left out: no camera stands in the middle of a bin's floor.
  if (!cell.bin->base_from_bin.isApprox(Pose::Identity()) || !base_from_input.isApprox(Pose::Identity()))
    out.camera_from_bin = camera_from_bin;
  return out;
}

Found find_parts(const Scan& scan, std::span<const Part> parts, const FinderOptions& options) {
  Found found;
  for (const std::string& w : scan.warnings) found.warnings.push_back({"scan", w});
  for (const Part& part : parts) {
    check_size(scan, part, found.warnings);
    for (const std::string& w : part.warnings) found.warnings.push_back({"cad", part.name + ": " + w});
  }
  SurfelOptions surfel = options.surfel;
  SegmentationOptions segmentation = options.segmentation;
  if (segmentation.radii_mm.empty()) segmentation.radii_mm = radii_of(parts);
  if (!segmentation.radii_mm.empty())
    surfel.max_radius_mm =
        static_cast<float>(*std::max_element(segmentation.radii_mm.begin(), segmentation.radii_mm.end()));

  segmentation.boundaries = false;  // nothing below reads them

  {
    const StageTimer timer(found.times, "surface_normals");
    found.surfels = surfels_from_scan(scan, surfel);
  }
  {
    const StageTimer timer(found.times, "segmentation");
    found.primitives = segment(found.surfels, segmentation);
  }
  {
    const StageTimer timer(found.times, "modelling");
    found.observation = build_model(found.primitives, found.surfels);
  }
  if (options.bin) {
    const StageTimer timer(found.times, "bin");
    found.bin = find_bin(*options.bin, found.surfels, found.observation);
    warn_of_bin(*found.bin, found.warnings);
  }
  {
    const StageTimer timer(found.times, "recognition_and_pose");
    RecognitionOptions recognition;
    if (found.bin && found.bin->found) recognition.bin = &*found.bin;
    recognition.work_limit = options.work_limit;
    recognition.tolerance_mm = options.tolerance_mm;
    recognition.tolerance_rad = options.tolerance_rad;
    // What the stages before took counts too.
    if (options.time_limit_ms > 0)
      recognition.time_limit_ms = std::max(1, options.time_limit_ms - static_cast<int>(found.times.total()));
    found.instances = options.method == Method::paper
                          ? paper::recognize(found.primitives, found.observation, found.surfels, parts)
                          : recognize(found.primitives, found.observation, found.surfels, parts, recognition);
  }
  if (found.instances.time_limit)
    found.status = "time_limit";
  else if (!found.instances.items.empty())
    found.status = "ok";
  else
    found.status =
        found.instances.unexplained.empty() && found.instances.uncertain.empty() ? "empty" : "not_empty_no_object";
  return found;
}

}  // namespace tribin
