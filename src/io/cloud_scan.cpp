#include <algorithm>
#include <cmath>
#include <limits>

#include "io/cloud_camera.hpp"
#include "io/depth_image.hpp"
#include "io/lattice.hpp"
#include "io/raw_cloud.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/io/camera_file.hpp"

namespace tribin::io {
namespace {

// A pinhole is taken for the grid's camera up to this (architecture: 0.1 px is 1/18000 of a view's width, below the
// noise of x and y of any scanner); up to the second a smooth lens is; beyond, pixel and point do not belong together.
constexpr double kPinholePx = 0.1;
constexpr double kLensPx = 0.5;

/// The cloud in a frame in which its camera looks along +z, with the pixel axes along x and y.
struct Upright {
  Image<Vec3f> points;
  Pose camera_from_file = Pose::Identity();
  CameraFit fit;
  std::vector<std::string> warnings;
};

Image<Vec3f> mapped(const Image<Vec3f>& points, const Pose& pose) {
  Image<Vec3f> out(points.width, points.height, Vec3f::Zero());
  parallel_ranges(points.height, 64, [&](int begin, int end) {
    for (int v = begin; v < end; ++v) {
      for (int u = 0; u < points.width; ++u) {
        out(u, v) = Vec3f((pose * Vec3(points(u, v).cast<double>())).cast<float>());
      }
    }
  });
  return out;
}

/// A half turn by signs; exact, unlike a rotation matrix of cos and sin.
void turn(Upright& cloud, const Vec3& signs) {
  const Vec3f s = signs.cast<float>();
  for (Vec3f& p : cloud.points.data) p = p.cwiseProduct(s);
  Pose turned = Pose::Identity();
  turned.linear() = Matrix3(signs.asDiagonal());
  cloud.camera_from_file = turned * cloud.camera_from_file;
}

void transpose(Upright& cloud) {
  Image<Vec3f> out(cloud.points.height, cloud.points.width, Vec3f::Zero());
  for (int v = 0; v < out.height; ++v) {
    for (int u = 0; u < out.width; ++u) out(u, v) = cloud.points(v, u);
  }
  cloud.points = std::move(out);
  cloud.warnings.push_back("the grid is stored column by column; it was transposed");
}

void flip_rows(Upright& cloud) {
  for (int v = 0; v < cloud.points.height / 2; ++v) {
    std::swap_ranges(cloud.points.row(v), cloud.points.row(v) + cloud.points.width,
                     cloud.points.row(cloud.points.height - 1 - v));
  }
  cloud.warnings.push_back("the grid is stored as a mirror image; its rows were turned upside down");
}

/// Whether most of the points lie at negative z.
bool looks_backward(const Image<Vec3f>& points) {
  std::size_t front = 0, back = 0;
  for (const Vec3f& p : points.data) {
    front += p.z() > 0;
    back += p.z() < 0;
  }
  return back > front;
}

Upright upright(Image<Vec3f> points, const Pose& camera_from_file) {
  Upright cloud{std::move(points), camera_from_file, {}, {}};
  if (looks_backward(cloud.points)) turn(cloud, {1, -1, -1});
  cloud.fit = fit_pinhole(cloud.points);
  if (cloud.fit.transposed) {
    transpose(cloud);
    cloud.fit = fit_pinhole(cloud.points);
  }
  bool changed = false;
  if (cloud.fit.camera.fx * cloud.fit.camera.fy < 0) {
    flip_rows(cloud);
    cloud.fit.camera.fy = -cloud.fit.camera.fy;
    changed = true;
  }
  if (cloud.fit.camera.fx < 0) {
    turn(cloud, {-1, -1, 1});
    changed = true;
  }
  if (changed) cloud.fit = fit_pinhole(cloud.points);
  return cloud;
}

/// Points in the file's frame [mm], with NaN for holes. \return how many are no holes.
std::size_t scaled(RawCloud& cloud, double scale, Image<Vec3f>& points) {
  const float s = static_cast<float>(scale);
  std::size_t count = 0;
  for (Vec3f& p : cloud.points) {
    if (is_hole(p)) {
      p.setConstant(std::numeric_limits<float>::quiet_NaN());
    } else {
      p *= s;
      ++count;
    }
  }
  points.width = cloud.width;
  points.height = cloud.height;
  points.data = std::move(cloud.points);
  return count;
}

void apply_camera_file(const ScanReadOptions& options, Scan& scan, const Image<Vec3f>& points) {
  const CameraFile file = read_camera_file(options.camera_file, options.image_id);
  scan.noise = file.noise;
  double worst = 0;  // of the file's camera against the points themselves
  for (int v = 0; v < points.height; v += 7) {
    for (int u = 0; u < points.width; u += 7) {
      const Vec3f& p = points(u, v);
      if (!std::isfinite(scan.z_mm(u, v))) continue;
      worst = std::max(worst, (file.camera.project(p.cast<double>()) - Vec2(u, v)).norm());
    }
  }
  if (worst > 1 && !file.distorted()) {
    char text[120];
    std::snprintf(text, sizeof text,
                  "the camera file misses the cloud's own rays by up to %.1f px; the cloud's are used", worst);
    scan.warnings.push_back(text);
  }
}

std::string pixels(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3g px", value);
  return text;
}

}  // namespace

double cloud_unit(const RawCloud& cloud, LengthUnit unit, std::vector<std::string>& warnings) {
  if (unit != LengthUnit::automatic) return millimetres_in(unit);
  std::vector<float> ranges;
  const std::size_t step = cloud.points.size() / 20'000 + 1;  // a median needs no more
  for (std::size_t i = 0; i < cloud.points.size(); i += step) {
    if (!is_hole(cloud.points[i])) ranges.push_back(cloud.points[i].norm());
  }
  return guess_unit(ranges, warnings);
}

Scan scan_from_cloud(RawCloud cloud, const ScanReadOptions& options) {
  if (!cloud.organized()) {
    if (auto regained = regain_grid(cloud)) return scan_from_cloud(std::move(*regained), options);
    bad_file(cloud.name, "", std::to_string(cloud.points.size()) + " loose points",
             "an organized scan (a grid of width x height)", ErrorCode::too_little_data);
  }
  Scan scan;
  scan.source = cloud.name;
  scan.warnings = cloud.warnings;
  scan.taken = cloud.taken;
  const double scale = cloud_unit(cloud, options.unit, scan.warnings);
  Image<Vec3f> points;
  const std::size_t count = scaled(cloud, scale, points);
  if (count < 10) {
    bad_file(cloud.name, "", std::to_string(count) + " valid points", "a scan with measurements",
             ErrorCode::too_little_data);
  }
  // Some writers give points in the camera's frame and VIEWPOINT as the camera's place in the world, others give points
  // in that world. The grid tells: from the camera's place, and only from there, point (u, v) lies on the ray of pixel
  // (u, v).
  Upright best = upright(points, Pose::Identity());
  const auto consider = [&](const Pose& camera_from_file, const std::string& warning) {
    Upright other = upright(mapped(points, camera_from_file), camera_from_file);
    if (other.fit.rms_px < 0.5 * best.fit.rms_px) {
      best = std::move(other);
      best.warnings.push_back(warning);
    }
  };
  if (cloud.viewpoint && best.fit.rms_px > kPinholePx) {
    Pose viewpoint = *cloud.viewpoint;
    viewpoint.translation() *= scale;
    consider(viewpoint.inverse(), "the points are in the frame that VIEWPOINT refers to; results are given in it");
  }
  const bool moved = cloud.viewpoint && !cloud.viewpoint->matrix().isIdentity(1e-9);
  if (moved && best.camera_from_file.translation().isZero() && best.fit.rms_px <= kPinholePx) {
    best.warnings.push_back(
        "the points are in the camera's own frame, and so are the results; VIEWPOINT is not applied");
  }
  LensFit lens;
  if (best.fit.rms_px > kPinholePx) lens = fit_lens(best.points, best.fit.camera);
  if (best.fit.rms_px > kPinholePx && lens.rms_px > kLensPx) {
    if (const auto camera_from_file = locate_camera(points)) {
      consider(*camera_from_file, "the cloud is not in its camera's frame; the camera's place was found from the grid");
      lens = best.fit.rms_px > kPinholePx ? fit_lens(best.points, best.fit.camera) : LensFit{};
    }
  }
  if (best.fit.camera.fx == 0 || (best.fit.rms_px > kPinholePx && lens.rms_px > kLensPx)) {
    bad_file(cloud.name, "", "a grid whose points miss the rays of any camera by " + pixels(best.fit.rms_px) + " rms",
             "points seen from one place, each in its pixel (or read it as loose points)");
  }
  scan.camera = best.fit.camera;
  scan.input_from_camera = best.camera_from_file.inverse();
  scan.warnings.insert(scan.warnings.end(), best.warnings.begin(), best.warnings.end());
  if (best.fit.rms_px > kPinholePx) {
    scan.rays = std::move(lens.rays);
    scan.warnings.push_back("the grid is " + pixels(best.fit.rms_px) +
                            " rms off a pinhole; each pixel keeps its own ray");
  }
  scan.z_mm = Image<float>(best.points.width, best.points.height);
  std::size_t behind = 0;
  for (std::size_t i = 0; i < scan.z_mm.size(); ++i) {
    const float z = best.points.data[i].z();
    behind += z <= 0;
    scan.z_mm.data[i] = z > 0 ? z : std::numeric_limits<float>::quiet_NaN();
  }
  if (behind) scan.warnings.push_back(std::to_string(behind) + " points behind the camera were left out");
  if (!options.camera_file.empty()) apply_camera_file(options, scan, best.points);
  return scan;
}

PointSet points_from_cloud(const RawCloud& cloud, const ScanReadOptions& options) {
  PointSet set;
  set.source = cloud.name;
  set.warnings = cloud.warnings;
  set.taken = cloud.taken;
  const double scale = cloud_unit(cloud, options.unit, set.warnings);
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
  set.points.reserve(cloud.points.size());
  // Many points at 0 0 0 are holes of a writer without NaN; a single one is a point.
  const auto zeros = std::count(cloud.points.begin(), cloud.points.end(), Vec3f(0, 0, 0));
  for (const Vec3f& p : cloud.points) {
    if (!p.allFinite() || (zeros > 1 && is_hole(p))) continue;
    set.points.push_back(p * static_cast<float>(scale));
    low = low.cwiseMin(set.points.back());
    high = high.cwiseMax(set.points.back());
  }
  if (set.points.empty()) bad_file(cloud.name, "", "no valid point", "points", ErrorCode::too_little_data);
  // Of loose points only the camera's place matters. PCL reads it from VIEWPOINT in the frame of the points, and so do
  // we; its rotation turns nothing then. Else it is the origin, unless the points surround it (a merged or a CAD
  // cloud).
  const Vec3 place = cloud.viewpoint ? Vec3(cloud.viewpoint->translation() * scale) : Vec3::Zero();
  if (cloud.viewpoint && !cloud.viewpoint->linear().isIdentity(1e-9)) {
    set.warnings.push_back("the rotation of VIEWPOINT is not used: loose points are taken in the frame of the file");
  }
  const Vec3f p = place.cast<float>();
  const bool inside = (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
  if (!inside || !place.isZero()) set.viewpoint = place;
  return set;
}

}  // namespace tribin::io
