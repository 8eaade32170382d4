#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "support/shared_data.hpp"
#include "tribin/capture/triangulate.hpp"
#include "tribin/io/frames_file.hpp"
#include "tribin/io/rig_file.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin {
namespace {

Triangulated scan_of(const std::string& name) {
  const std::filesystem::path folder = test::shared_data("real/" + name);
  const std::filesystem::path rig = std::filesystem::path(TRIBIN_SOURCE_DIR) / "examples/rigs" / name;
  const std::vector<FrameStack> frames = read_frames(folder, rig / "frames.json");
  return triangulate(read_rig(rig / "rig.json", folder), decode(frames[0]), decode(frames[1]));
}

/// Share of the valid pixels that are off the median of their 5 x 5 by more than `limit` [mm].
double share_off_median(const Scan& s, float limit) {
  std::size_t valid = 0, off = 0;
  std::vector<float> window;
  for (int v = 2; v < s.height() - 2; ++v)
    for (int u = 2; u < s.width() - 2; ++u) {
      if (!std::isfinite(s.z_mm(u, v))) continue;
      window.clear();
      for (int j = -2; j <= 2; ++j)
        for (int i = -2; i <= 2; ++i)
          if (std::isfinite(s.z_mm(u + i, v + j))) window.push_back(s.z_mm(u + i, v + j));
      const auto middle = window.begin() + static_cast<std::ptrdiff_t>(window.size() / 2);
      std::nth_element(window.begin(), middle, window.end());
      ++valid;
      off += std::abs(*middle - s.z_mm(u, v)) > limit;
    }
  return static_cast<double>(off) / static_cast<double>(valid);
}

struct Flat {
  std::size_t points = 0;
  double kept = 0, rms = 0, correlation_u = 0, correlation_v = 0;
};

/// A free plane through the pixels of a rectangle (u0, v0 .. u1, v1), points beyond 3 rms left out.
Flat plane_through(const Scan& s, int u0, int v0, int u1, int v1) {
  Image<float> residual(s.width(), s.height(), 0);
  Flat out;
  std::size_t all = 0;
  for (int round = 0; round < 8; ++round) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    std::size_t n = 0;
    const auto each = [&](auto&& visit) {
      for (int v = v0; v < v1; ++v)
        for (int u = u0; u < u1; ++u)
          if (std::isfinite(s.z_mm(u, v))) visit(u, v, Eigen::Vector3d(s.point(u, v)));
    };
    const auto used = [&](int u, int v) { return round == 0 || std::abs(residual(u, v)) < 3 * out.rms; };
    each([&](int u, int v, const Eigen::Vector3d& p) {
      if (used(u, v)) mean += p, ++n;
    });
    if (round == 0) all = n;
    mean /= static_cast<double>(n);
    each([&](int u, int v, const Eigen::Vector3d& p) {
      if (used(u, v)) square += (p - mean) * (p - mean).transpose();
    });
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(square);
    const Eigen::Vector3d normal = solver.eigenvectors().col(0);
    out.points = n;
    out.kept = static_cast<double>(n) / static_cast<double>(all);
    out.rms = std::sqrt(solver.eigenvalues()[0] / static_cast<double>(n));
    each([&](int u, int v, const Eigen::Vector3d& p) { residual(u, v) = static_cast<float>(normal.dot(p - mean)); });
  }
  const auto correlation = [&](int du, int dv) {
    double sum = 0;
    std::size_t n = 0;
    for (int v = v0; v < v1 - 1; ++v)
      for (int u = u0; u < u1 - 1; ++u) {
        const float a = residual(u, v), b = residual(u + du, v + dv);
        if (!std::isfinite(s.z_mm(u, v)) || !std::isfinite(s.z_mm(u + du, v + dv))) continue;
        if (std::abs(a) < 3 * out.rms && std::abs(b) < 3 * out.rms) sum += a * b, ++n;
      }
    return sum / static_cast<double>(n) / (out.rms * out.rms);
  };
  out.correlation_u = correlation(1, 0);
  out.correlation_v = correlation(0, 1);
  return out;
}

TEST(RealRigs, GearboxFromRawFrames) {
  TRIBIN_NEED_DATA(test::shared_data("real/gearbox_stereo"));
  const Triangulated t = scan_of("gearbox_stereo");
  const Scan& s = t.scan;
  const double valid = static_cast<double>(valid_count(s)) / static_cast<double>(s.z_mm.size());
  const double off = share_off_median(s, 5);
  RecordProperty("valid", std::to_string(valid));
  RecordProperty("off_median", std::to_string(off));
  EXPECT_GE(valid, 0.53);
  EXPECT_LE(off, 0.005);
  EXPECT_TRUE(s.warnings.empty());

  // The two recessed panels of the casing's face below the bores.
  for (const auto& [u0, u1] : {std::pair{330, 550}, {620, 860}}) {
    const Flat flat = plane_through(s, u0, 690, u1, 810);
    RecordProperty("plane_" + std::to_string(u0), std::to_string(flat.rms) + " of " + std::to_string(flat.points) +
                                                      ", correlation " + std::to_string(flat.correlation_u) + ", " +
                                                      std::to_string(flat.correlation_v));
    EXPECT_GE(flat.points, 19000u);
    EXPECT_GE(flat.kept, 0.95);
    EXPECT_LE(flat.rms, 0.40);
    EXPECT_LE(flat.correlation_u, 0.5);
    EXPECT_LE(flat.correlation_v, 0.5);
  }

  // No seams: on the cardboard box, where some 20 period borders lie, no image column has more holes or jumps than a
  // hundredth of its pixels.
  int seams = 0;
  for (int u = 700; u < 1470; ++u) {
    int bad = 0;
    for (int v = 100; v < 290; ++v) bad += !(std::abs(s.z_mm(u, v) - s.z_mm(u - 1, v)) < 5);
    seams += bad > 19;  // a tenth: labels and print stay below it
  }
  EXPECT_EQ(seams, 0);

  const Primitives found = segment(surfels_from_scan(s));
  std::vector<double> holes;
  for (const Primitive& p : found.items)
    for (const BoundaryLoop& loop : p.loops)
      if (loop.inner && loop.circle && loop.circle->radius_mm >= 10 && loop.circle->rms_mm <= 0.6 &&
          loop.circle->arc >= 270 * kDegree)
        holes.push_back(loop.circle->radius_mm);
  std::sort(holes.begin(), holes.end());
  ASSERT_EQ(holes.size(), 2u);
  EXPECT_NEAR(holes[0], 23.9, 0.5);
  EXPECT_NEAR(holes[1], 31.5, 0.5);
}

TEST(RealRigs, ConeAndCylinderFromSaturatedFrames) {
  TRIBIN_NEED_DATA(test::shared_data("real/cone_cylinder_stereo"));
  const Triangulated t = scan_of("cone_cylinder_stereo");
  EXPECT_GE(valid_count(t.scan), 91446u);  // what a plain decoder gets
  EXPECT_LE(share_off_median(t.scan, 5), 0.005);
}

}  // namespace
}  // namespace tribin
