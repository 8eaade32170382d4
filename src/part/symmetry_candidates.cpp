#include "part/symmetry_candidates.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace tribin {
namespace {

constexpr double kMostAngle = 40 * kDegree;  // however much facets bend: beyond, the two sides of a small rib mix
constexpr double kSameLine = 1.5 * kDegree;  // axes closer than this are polished to the same motions
constexpr int kScanSteps = 90;               // 4 deg: half a step moves the rim by 1.7 % of the diameter at most

double cosine_limit(const SurfaceSample& sample, double angle) {
  return std::cos(std::min(kMostAngle, std::max(angle, 1.2 * sample.bend)));
}

struct Line {
  Vec3 direction;
  double weight = 0;
};

/// Adds a line by weight unless a like one is there already (then that one gains the weight).
void add_line(std::vector<Line>& lines, const Vec3& direction, double weight) {
  const double norm = direction.norm();
  if (norm < 1e-6) return;
  const Vec3 d = direction / norm;
  for (Line& line : lines)
    if (std::abs(line.direction.dot(d)) > std::cos(kSameLine)) return void(line.weight += weight);
  lines.push_back({d, weight});
}

void sort_by_weight(std::vector<Line>& lines) {
  std::stable_sort(lines.begin(), lines.end(), [](const Line& a, const Line& b) { return a.weight > b.weight; });
}

/// Peaks of the face normals, as lines, by share of the area.
std::vector<Line> normal_peaks(std::span<const SurfaceSample> samples) {
  std::vector<Line> lines;
  for (const SurfaceSample& s : samples) add_line(lines, s.normal, 1.0 / samples.size());
  sort_by_weight(lines);
  std::erase_if(lines, [](const Line& line) { return line.weight < 0.01; });
  if (lines.size() > 9) lines.resize(9);
  return lines;
}

/// Directions that much of the surface runs along: prisms, cylinders, turned and extruded parts.
std::vector<Line> ruling_peaks(std::span<const SurfaceSample> samples) {
  std::vector<Line> lines;
  const std::size_t count = std::min<std::size_t>(samples.size(), 40);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = i + 1; j < count; ++j) {
      const Vec3 cross = samples[i].normal.cross(samples[j].normal);
      if (cross.norm() > 0.3) add_line(lines, cross, 1);
    }
  sort_by_weight(lines);
  if (lines.size() > 40) lines.resize(40);
  for (Line& line : lines) {
    int beside = 0;
    for (const SurfaceSample& s : samples) beside += std::abs(s.normal.dot(line.direction)) < 0.035;  // 2 deg
    line.weight = static_cast<double>(beside) / samples.size();
  }
  sort_by_weight(lines);
  if (lines.size() > 3) lines.resize(3);
  return lines;
}

/// The point that the normals beside the axis point to: the middle of its cylinders and of its regular prisms.
Vec3 meeting_point(std::span<const SurfaceSample> samples, const Vec3& direction, const Vec3& start, double scale_mm) {
  Vec3 point = start;
  for (int iteration = 0; iteration < 12; ++iteration) {
    Eigen::Matrix3d a = 1e-3 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d b = 1e-3 * point;
    for (const SurfaceSample& s : samples) {
      const Vec3 across = direction.cross(s.normal);
      const double length = across.norm();
      if (length < 0.3) continue;  // faces the axis: says nothing about where it is
      const Vec3 m = across / length;
      const double residual = m.dot(s.point - point) / scale_mm;
      const double weight = 1 / (1 + residual * residual);
      a += weight / samples.size() * m * m.transpose();
      b += weight / samples.size() * m * m.dot(s.point);
    }
    point = a.ldlt().solve(b);
    scale_mm = std::max(0.7 * scale_mm, 1e-6);
    point -= direction * direction.dot(point - start);
  }
  return point;
}

}  // namespace

double overlap_of(const SurfaceIndex& surface, std::span<const SurfaceSample> samples, const Pose& motion,
                  const Nearness& nearness, double floor) {
  const int count = static_cast<int>(samples.size());
  const int needed = static_cast<int>(std::ceil(floor * count));
  int inside = 0;
  for (int i = 0; i < count; ++i) {
    if (inside + (count - i) < needed) return static_cast<double>(inside) / count;
    const SurfaceSample& s = samples[i];
    inside += surface.has_near(motion * s.point, motion.linear() * s.normal, std::max(nearness.radius_mm, s.slack_mm),
                               cosine_limit(s, nearness.angle));
  }
  return static_cast<double>(inside) / count;
}

Pose polish(const SurfaceIndex& surface, std::span<const SurfaceSample> samples, Pose motion, double from_mm,
            double to_mm, int iterations) {
  const double lever = 0.35 * surface.diameter_mm();  // makes turning and shifting alike in size
  const Vec3 middle = surface.centroid();
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const double share = iterations > 1 ? static_cast<double>(iteration) / (iterations - 1) : 1;
    const double reach = from_mm * std::pow(to_mm / from_mm, share);
    Eigen::Matrix<double, 6, 6> h = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> g = Eigen::Matrix<double, 6, 1>::Zero();
    int used = 0;
    for (const SurfaceSample& s : samples) {
      const Vec3 p = motion * s.point;
      const SurfaceHit hit =
          surface.nearest(p, motion.linear() * s.normal, std::max(reach, s.slack_mm), cosine_limit(s, 25 * kDegree));
      if (hit.triangle < 0) continue;
      const Vec3& n = surface.normal(hit.triangle);
      Eigen::Matrix<double, 6, 1> row;
      row << n, (p - middle).cross(n) / lever;
      h += row * row.transpose();
      g += row * n.dot(p - hit.point);
      ++used;
    }
    if (used < 12) return motion;
    // A part of a percent of the surface holds a direction, if it does so at all; less is noise of the facets.
    h.diagonal().array() += 1e-4 * used;
    const Eigen::Matrix<double, 6, 1> step = -h.ldlt().solve(g);
    const Pose before = motion;
    const Matrix3 r = rotation_from_vector(step.tail<3>() / lever);
    motion.linear() = r * before.linear();
    motion.translation() = r * (before.translation() - middle) + middle + step.head<3>();
  }
  motion.linear() = rotation_from_vector(vector_from_rotation(motion.linear()));
  return motion;
}

Pose turn(const Axis& axis, double angle) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(axis.direction * angle);
  pose.translation() = axis.point - pose.linear() * axis.point;
  return pose;
}

Axis axis_of(const Pose& motion) {
  Axis axis;
  axis.direction = vector_from_rotation(motion.linear()).normalized();
  const Eigen::Vector3d t = motion.translation() - axis.direction * axis.direction.dot(motion.translation());
  // (I - R) x = t has its solutions on the axis; the one nearest to the origin is made unique by d d^T.
  const Eigen::Matrix3d a = Eigen::Matrix3d::Identity() - motion.linear() + axis.direction * axis.direction.transpose();
  axis.point = a.partialPivLu().solve(t);
  return axis;
}

std::vector<Axis> candidate_axes(const SurfaceIndex& surface, std::span<const SurfaceSample> samples) {
  std::vector<Line> lines;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal{Eigen::Matrix3d(surface.covariance())};
  for (int k = 0; k < 3; ++k) add_line(lines, Vec3(principal.eigenvectors().col(k)), 0);
  for (const Line& line : ruling_peaks(samples)) add_line(lines, line.direction, 0);
  const std::vector<Line> peaks = normal_peaks(samples);
  for (const Line& peak : peaks) add_line(lines, peak.direction, 0);
  // The half turns between like faces, and the threefold axes of three of them.
  const std::size_t few = std::min<std::size_t>(peaks.size(), 4);
  for (std::size_t i = 0; i < few; ++i)
    for (std::size_t j = i + 1; j < few; ++j) {
      add_line(lines, peaks[i].direction + peaks[j].direction, 0);
      add_line(lines, peaks[i].direction - peaks[j].direction, 0);
      for (std::size_t k = j + 1; k < few; ++k)
        for (const double sj : {1.0, -1.0})
          for (const double sk : {1.0, -1.0})
            add_line(lines, peaks[i].direction + sj * peaks[j].direction + sk * peaks[k].direction, 0);
    }
  std::vector<Axis> axes;
  for (const Line& line : lines) {
    axes.push_back({line.direction, surface.centroid()});
    if (axes.size() > 12) continue;  // the main directions only
    const Vec3 other = meeting_point(samples, line.direction, surface.centroid(), 0.1 * surface.diameter_mm());
    const double apart = (other - surface.centroid()).norm();
    if (apart > 0.01 * surface.diameter_mm() && apart < 0.3 * surface.diameter_mm())
      axes.push_back({line.direction, other});
  }
  return axes;
}

std::vector<Candidate> scan_turns(const SurfaceIndex& surface, std::span<const SurfaceSample> samples, const Axis& axis,
                                  const Nearness& nearness, double min_overlap) {
  Vec3 u, v;
  orthonormal_basis(axis.direction, u, v);
  std::vector<Candidate> best;
  for (const bool flipped : {false, true}) {
    const Pose base = flipped ? turn({u, axis.point}, kPi) : Pose::Identity();
    // A turn and the one back keep the same share in place: half of the circle is enough. Not so after a half turn.
    const int last = flipped ? kScanSteps - 1 : kScanSteps / 2;
    std::vector<Candidate> tried(kScanSteps);
    for (int i = 0; i <= last; ++i) {
      tried[i].motion = turn(axis, 2 * kPi * i / kScanSteps) * base;
      tried[i].overlap = !flipped && i == 0 ? 1 : overlap_of(surface, samples, tried[i].motion, nearness, min_overlap);
    }
    const auto overlap = [&](int i) {
      const int k = (i + kScanSteps) % kScanSteps;
      return tried[k > last ? kScanSteps - k : k].overlap;
    };
    for (int i = flipped ? 0 : 1; i <= last; ++i) {
      if (overlap(i) < min_overlap || overlap(i) < overlap(i - 1) || overlap(i) < overlap(i + 1)) continue;
      if (overlap(i) == overlap(i - 1) && i % 3 != 0) continue;  // a plateau: a few of it are enough
      best.push_back(tried[i]);
    }
  }
  return best;
}

}  // namespace tribin
