#include <algorithm>
#include <cmath>

#include "hypotheses.hpp"
#include "point_pairs.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/core/thin_points.hpp"

namespace tribin {
namespace {

constexpr int kTurns = PointPairTable::kTurns;
constexpr std::size_t kEvery = 2;  // one of so many points votes: a part that shows 40 % of itself has some 50 of them
constexpr int kPeaks = 4;          // of each voter: beside a flat face the right place is not always the first

struct OrientedPoints {
  std::vector<Vec3f> points, normals;
};

/// What is left to explain, thinned.
OrientedPoints unexplained_points(const SceneFeatures& scene, const Image<std::uint8_t>& background, const Part& part,
                                  double spacing_mm) {
  OrientedPoints all, out;
  for (const std::uint32_t s : unexplained_surfels(scene, background, part)) {
    all.points.push_back(scene.surfels->position[s]);
    all.normals.push_back(scene.surfels->normal[s]);
  }
  for (const std::uint32_t i : thin_points(all.points, all.normals, spacing_mm)) {
    out.points.push_back(all.points[i]);
    out.normals.push_back(all.normals[i]);
  }
  return out;
}

/// The pose that lays one oriented point of the part onto one of the scan, turned about the normal.
Pose pose_of(const Vec3f& part_point, const Vec3f& part_normal, const Vec3f& scene_point, const Vec3f& scene_normal,
             double turn) {
  Vec3 pu, pv, su, sv;
  orthonormal_basis(part_normal.cast<double>(), pu, pv);
  orthonormal_basis(scene_normal.cast<double>(), su, sv);
  const Vec3 n = scene_normal.cast<double>();
  return pose_from(
      rotation_from_directions(part_normal.cast<double>(), pu, n, su * std::cos(turn) + sv * std::sin(turn)),
      part_point.cast<double>(), scene_point.cast<double>());
}

}  // namespace

void hypotheses_from_point_pairs(const SceneFeatures& scene, const Image<std::uint8_t>& background, const Part& part,
                                 const PointPairTable& table, std::vector<Pose>& out) {
  const double spacing = 0.05 * part.diameter_mm;
  const OrientedPoints seen = unexplained_points(scene, background, part, spacing);
  if (seen.points.size() < 8) return;
  const std::size_t cells = part.sample_points.size() * kTurns;
  const auto reach = static_cast<float>(part.diameter_mm * part.diameter_mm);

  const auto voters = static_cast<int>((seen.points.size() + kEvery - 1) / kEvery);
  std::vector<std::vector<Pose>> found(static_cast<std::size_t>(voters));
  parallel_ranges(voters, 4, [&](int begin, int end) {
    std::vector<std::uint16_t> votes(cells);
    for (int k = begin; k < end; ++k) {
      const std::size_t r = static_cast<std::size_t>(k) * kEvery;
      if (!scene.changed_near(seen.points[r], 1.1 * part.diameter_mm)) continue;  // it votes as it did
      Vec3 ud, vd;
      orthonormal_basis(seen.normals[r].cast<double>(), ud, vd);
      const Vec3f u = ud.cast<float>(), v = vd.cast<float>();
      std::fill(votes.begin(), votes.end(), std::uint16_t{0});
      for (std::size_t i = 0; i < seen.points.size(); ++i) {
        if ((seen.points[i] - seen.points[r]).squaredNorm() > reach || i == r) continue;
        const auto pair = table.steps().pair(seen.points[r], seen.normals[r], u, v, seen.points[i], seen.normals[i]);
        if (!pair) continue;
        const int turn = static_cast<int>(std::floor(pair->turn / (2 * kPi) * kTurns));
        for (const PointPairTable::Entry& e : table.with(pair->key))
          ++votes[static_cast<std::size_t>(e.point) * kTurns +
                  static_cast<std::size_t>((turn - e.turn) & (kTurns - 1))];
      }
      // The best turn of each point of the part, then the best points.
      struct Peak {
        int votes;
        std::uint32_t point;
        int turn;
      };
      std::vector<Peak> peaks;
      for (std::uint32_t p = 0; p < part.sample_points.size(); ++p) {
        const std::uint16_t* row = votes.data() + static_cast<std::size_t>(p) * kTurns;
        Peak best{0, p, 0};
        for (int t = 0; t < kTurns; ++t)  // steps fall between two cells as often as not
          if (const int sum = row[t] + row[(t + 1) & (kTurns - 1)]; sum > best.votes) best = {sum, p, t};
        if (best.votes > 0) peaks.push_back(best);
      }
      const std::size_t keep = std::min<std::size_t>(kPeaks, peaks.size());
      std::partial_sort(
          peaks.begin(), peaks.begin() + static_cast<std::ptrdiff_t>(keep), peaks.end(),
          [](const Peak& a, const Peak& b) { return a.votes != b.votes ? a.votes > b.votes : a.point < b.point; });
      for (std::size_t i = 0; i < keep; ++i)
        found[static_cast<std::size_t>(k)].push_back(
            pose_of(part.sample_points[peaks[i].point], part.sample_normals[peaks[i].point], seen.points[r],
                    seen.normals[r], (peaks[i].turn + 0.5) * 2 * kPi / kTurns));
    }
  });
  for (const std::vector<Pose>& poses : found) out.insert(out.end(), poses.begin(), poses.end());
}

}  // namespace tribin
