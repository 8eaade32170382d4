#include "likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tribin/core/parallel.hpp"
#include "tribin/pose/drawn_out.hpp"
#include "tribin/pose/index_render.hpp"

namespace tribin {
namespace {

constexpr float kUnexplained = 0.5f * 16;  // 4 sigma, and what a pixel costs that no surface explains
// And more where a surface should be seen and something else is: it is worse to be refuted than to say nothing.
// Of what should be seen, whole patches are not, for mirrored light and what the part differs from its CAD: with 3 and
// 8 nats a pixel three to five more of 1000 answers in 120 simulated heaps are false.
constexpr float kRefuted = 1;

/// What a rendered pose says of the pixels that are measured.
struct Prediction {
  int u0 = 0, v0 = 0, width = 0, height = 0;
  int i0 = 0, j0 = 0;                 ///< its first pixel in the common window
  std::vector<float> error_mm;        ///< measured minus predicted, along the surface's normal; > 0 behind it
  std::vector<float> sigma_mm;        ///< 0 = nothing measured, or no surface there
  std::vector<std::uint8_t> covered;  ///< by the part; else its drawn-out edge. Empty = all that it says anything of
  float near_mm = 0;                  ///< what lies farther in front hides the part

  bool covers(std::size_t k) const { return sigma_mm[k] > 0 && (covered.empty() || covered[k]); }

  /// [nats]; 0 = at its place.
  float cost(std::size_t k) const {
    const float e = error_mm[k] / sigma_mm[k], square = 0.5f * e * e;
    if (square < kUnexplained) return square;
    return covers(k) && error_mm[k] > -near_mm ? kUnexplained + kRefuted : kUnexplained;
  }
};

/// The same where the sensor draws steps out: along outlines the part and what lies beyond, blurred into each other.
Prediction with_drawn_out_edges(const SceneDepth& scene, const Prediction& sharp, const DrawnOut& edges, int step_px) {
  Prediction out;
  out.near_mm = sharp.near_mm;
  out.u0 = sharp.u0 - edges.left * step_px, out.v0 = sharp.v0 - edges.top * step_px;
  out.width = edges.width, out.height = edges.height;
  out.error_mm.assign(edges.z_mm.size(), 0);
  out.sigma_mm.assign(edges.z_mm.size(), 0);
  out.covered.assign(edges.z_mm.size(), 0);
  for (int j = 0; j < sharp.height; ++j)
    for (int i = 0; i < sharp.width; ++i) {
      const std::size_t from = static_cast<std::size_t>(j) * static_cast<std::size_t>(sharp.width) + i,
                        to = edges.index(i + edges.left, j + edges.top);
      out.error_mm[to] = sharp.error_mm[from];
      out.sigma_mm[to] = sharp.sigma_mm[from];
      out.covered[to] = sharp.sigma_mm[from] > 0;
    }
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) {
      const std::size_t k = edges.index(i, j);
      const int u = out.u0 + i * step_px, v = out.v0 + j * step_px;
      if (!(edges.z_mm[k] > 0) || !(scene.z_mm(u, v) > 0)) continue;
      out.error_mm[k] = scene.z_mm(u, v) - edges.z_mm[k];
      out.sigma_mm[k] = std::hypot(scene.sigma_mm(u, v), edges.sigma_mm[k]);
    }
  return out;
}

Prediction predict(const SceneDepth& scene, const Part& part, Detail detail, const Pose& pose, int step_px) {
  thread_local IndexRender render;
  render_index(mesh_of(part, detail), scene.camera, pose, step_px, render);
  Prediction out;
  out.near_mm = static_cast<float>(0.03 * part.diameter_mm);  // as in the verification
  out.u0 = render.u0, out.v0 = render.v0, out.width = render.width, out.height = render.height;
  out.error_mm.assign(render.triangle.size(), 0);
  out.sigma_mm.assign(render.triangle.size(), 0);
  const auto cad_sigma = static_cast<float>(cad_sigma_mm(part, detail));
  for (int j = 0; j < render.height; ++j) {
    const int v = render.v0 + j * step_px;
    const auto ry = static_cast<float>((v - scene.camera.cy) / scene.camera.fy);
    for (int i = 0; i < render.width; ++i) {
      const std::size_t k = render.index(i, j);
      if (render.triangle[k] < 0) continue;
      const int u = render.u0 + i * step_px;
      const float z = scene.z_mm(u, v);
      if (!(z > 0)) continue;
      const auto rx = static_cast<float>((u - scene.camera.cx) / scene.camera.fx);
      const Vec3f& n = render.normal[static_cast<std::size_t>(render.triangle[k])];
      const float slant = std::max(0.2f, std::abs(n[0] * rx + n[1] * ry + n[2]));
      const float sigma = scene.sigma_mm(u, v) * slant;
      out.error_mm[k] = (z - 1 / render.inverse_z[k]) * slant;
      out.sigma_mm[k] = std::sqrt(sigma * sigma + cad_sigma * cad_sigma);
    }
  }
  if (scene.edge_blur_px > 0 && render.width > 0)
    return with_drawn_out_edges(scene, out, draw_out(scene, render), step_px);
  return out;
}

/// Predictions of several poses on one raster of pixels, and their common window.
struct Predictions {
  std::vector<Prediction> of;
  int u0 = 0, v0 = 0, width = 0, height = 0, step_px = 1;
  double inflation = 1;  ///< pixels closer than the noise's correlation tell the same story

  Predictions(const SceneDepth& scene, Detail detail, std::span<const std::pair<const Part*, Pose>> poses, int step)
      : of(poses.size()),
        step_px(step),
        inflation(std::max(1.0, correlation_inflation(scene.correlation_px) / (double(step) * step))) {
    parallel_each(static_cast<int>(poses.size()), [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      of[k] = predict(scene, *poses[k].first, detail, poses[k].second, step);
    });
    u0 = scene.camera.width, v0 = scene.camera.height;
    int u1 = -1, v1 = -1;
    for (const Prediction& p : of) {
      if (p.width == 0) continue;
      u0 = std::min(u0, p.u0);
      v0 = std::min(v0, p.v0);
      u1 = std::max(u1, p.u0 + (p.width - 1) * step);
      v1 = std::max(v1, p.v0 + (p.height - 1) * step);
    }
    if (u1 < u0) return;
    width = (u1 - u0) / step + 1;
    height = (v1 - v0) / step + 1;
    for (Prediction& p : of) {
      p.i0 = (p.u0 - u0) / step;
      p.j0 = (p.v0 - v0) / step;
    }
  }
};

/// What one prediction says of a pixel.
struct Look {
  bool any = false;      ///< a surface is there, or its edge
  bool covered = false;  ///< the surface
  float error_mm = 0, sigma_mm = 1;
  float cost = kUnexplained;  ///< [nats]

  /// \param i, j  of the common window
  Look(const Prediction& p, int i, int j) {
    i -= p.i0, j -= p.j0;
    if (i < 0 || j < 0 || i >= p.width || j >= p.height) return;
    const std::size_t at =
        static_cast<std::size_t>(j) * static_cast<std::size_t>(p.width) + static_cast<std::size_t>(i);
    if (!(p.sigma_mm[at] > 0)) return;
    any = true;
    covered = p.covers(at);
    error_mm = p.error_mm[at];
    sigma_mm = p.sigma_mm[at];
    cost = p.cost(at);
  }
};

/// Sd of what is common to a patch beyond the noise: errors of the sensor's shape, of the casting [mm].
double common_error_mm(const std::vector<double>& means, const std::vector<double>& variances) {
  if (means.size() < 8) return 0;
  std::vector<double> sizes(means.size());
  for (std::size_t i = 0; i < means.size(); ++i) sizes[i] = means[i] * means[i] - 0.455 * variances[i];
  // The median of a squared normal variable is 0.455 of its mean.
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<long>(sizes.size() / 2), sizes.end());
  return std::sqrt(std::max(0.0, sizes[sizes.size() / 2] / 0.455));
}

std::vector<double> likelihoods_of(const Predictions& all) {
  // All poses are judged on the union of their windows: what one explains and another does not counts against the
  // other.
  std::vector<double> out(all.of.size(), 0.0);
  Image<std::uint8_t> any(all.width, all.height, 0);
  for (const Prediction& p : all.of)
    for (int j = 0; j < p.height; ++j) {
      const std::size_t own = static_cast<std::size_t>(j) * static_cast<std::size_t>(p.width);
      const std::size_t row = any.index(p.i0, p.j0 + j);
      for (std::size_t i = 0; i < static_cast<std::size_t>(p.width); ++i) any.data[row + i] |= p.covers(own + i);
    }
  std::size_t judged = 0;
  for (const std::uint8_t a : any.data) judged += a;
  parallel_each(static_cast<int>(all.of.size()), [&](int which) {
    // Where this pose says nothing but another does, all is unexplained.
    const Prediction& p = all.of[static_cast<std::size_t>(which)];
    double sum = kUnexplained * static_cast<double>(judged);
    for (std::size_t k = 0; k < p.sigma_mm.size(); ++k) {
      if (!(p.sigma_mm[k] > 0)) continue;
      if (!p.covered.empty() && !any(p.i0 + static_cast<int>(k) % p.width, p.j0 + static_cast<int>(k) / p.width))
        continue;
      sum -= kUnexplained - p.cost(k);
    }
    out[static_cast<std::size_t>(which)] = -sum;
  });
  for (double& l : out) l /= all.inflation;
  return out;
}

/// Log of the odds of each pose against the first, from the pixels that tell the two apart: those where they predict
/// places that differ by more than the noise and four times what errors common to whole faces amount to (estimated from
/// the first pose's residuals, patch by patch). A patch of the image says at most so much: one that is measured wrongly
/// must not outvote the others. Where no pixel tells, the odds are even: 0.
/// \param order      indices into the predictions; odds are against the first.
/// \param elsewhere  cells that other parts explain: they tell nothing.
/// \return in that order; 0 for the first.
/// \source ours: "the discriminating patches" of the design notes, section 9. Residuals on all pixels let the pose win
///         that fits the sensor's smooth errors best: on simulated heaps a wrong pulley by 50 nats.
std::vector<double> odds_of(const SceneDepth& scene, const Predictions& all, const std::vector<std::size_t>& order,
                            const CellMask& elsewhere) {
  // Votes are counted by patches of the image: mirrored light, a burr, an edge a fraction of a pixel off move whole
  // patches, of either sign. So a patch counts at most 8 nats, and the sum counts beyond 1.5 sd of what the same votes
  // would sum to with random signs. Chosen on 148 comparisons of a true pose with its likeliest rival (32 simulated
  // heaps): taken at face value, sums of 1 to 20 nats were wrong as often as right; so, 2 of 18 over 1 nat are wrong
  // and none of 14 over 3.
  constexpr int kPatch = 4;  // rendered pixels: one or two millimetres
  constexpr double kMostOfPatch = 8, kChance = 1.5;
  std::vector<double> out(order.size(), 0.0);
  if (order.size() < 2) return out;
  const int width = all.width, height = all.height;
  const int patches_x = (width + kPatch - 1) / kPatch, patches_y = (height + kPatch - 1) / kPatch;
  const auto look = [&](std::size_t k, int i, int j) { return Look(all.of[order[k]], i, j); };

  // How far whole patches are off their surface in the likeliest pose.
  constexpr int kFace = 8;
  std::vector<double> means, variances;
  for (int j0 = 0; j0 < height; j0 += kFace)
    for (int i0 = 0; i0 < width; i0 += kFace) {
      double sum = 0, variance = 0;
      int n = 0;
      for (int j = j0; j < std::min(height, j0 + kFace); ++j)
        for (int i = i0; i < std::min(width, i0 + kFace); ++i) {
          const Look p = look(0, i, j);
          if (!p.any || std::abs(p.error_mm) > 5 * p.sigma_mm) continue;
          sum += p.error_mm;
          variance += p.sigma_mm * p.sigma_mm;
          ++n;
        }
      if (n < kFace * kFace / 2) continue;
      means.push_back(sum / n);
      variances.push_back(variance / n / n * all.inflation);
    }
  const auto common = static_cast<float>(4 * common_error_mm(means, variances));

  parallel_each(static_cast<int>(order.size()) - 1, [&](int which) {
    const auto k = static_cast<std::size_t>(which) + 1;
    // 1 where the two predict places that differ by more than noise and common errors.
    Image<std::uint8_t> tells(width, height, 0);
    Image<float> gain(width, height, 0);  // of pose k over the first [nats]
    for (int j = 0; j < height; ++j)
      for (int i = 0; i < width; ++i) {
        const Look first = look(0, i, j), other = look(k, i, j);
        if (!first.covered && !other.covered) continue;
        if (elsewhere.count > 0) {
          const int cu = (all.u0 + i * all.step_px) / scene.cell_px, cv = (all.v0 + j * all.step_px) / scene.cell_px;
          if (elsewhere.holds(static_cast<std::size_t>(cv) * static_cast<std::size_t>(scene.cell_normal.width) +
                              static_cast<std::size_t>(cu)))
            continue;
        }
        const float sigma = std::max(first.any ? first.sigma_mm : 0, other.any ? other.sigma_mm : 0);
        const float apart = first.any && other.any ? std::abs(first.error_mm - other.error_mm) : 1e9f;
        tells(i, j) = apart > std::max(sigma, common);
        gain(i, j) = first.cost - other.cost;
      }
    std::vector<double> votes(static_cast<std::size_t>(patches_x) * patches_y, 0.0);
    for (int j = 1; j + 1 < height; ++j)
      for (int i = 1; i + 1 < width; ++i) {
        if (!tells(i, j)) continue;
        // Lines one pixel wide come from edges that two refinements put a fraction of a pixel apart.
        int near = 0;
        for (int dj = -1; dj <= 1; ++dj)
          for (int di = -1; di <= 1; ++di) near += tells(i + di, j + dj);
        if (near >= 6) votes[static_cast<std::size_t>(j / kPatch) * patches_x + i / kPatch] += gain(i, j);
      }
    double sum = 0, squares = 0;
    for (const double vote : votes) {
      const double counted = std::clamp(vote / all.inflation, -kMostOfPatch, kMostOfPatch);
      sum += counted;
      squares += counted * counted;
    }
    out[k] = std::copysign(std::max(0.0, std::abs(sum) - kChance * std::sqrt(squares)), sum);
  });
  return out;
}

void sort_by(const std::vector<double>& value, std::vector<std::size_t>& order) {
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return value[a] > value[b]; });
}

/// \param order  the likeliest first.
Ranking rank_by_odds(const SceneDepth& scene, const Predictions& all, std::vector<std::size_t> order,
                     const CellMask& elsewhere) {
  Ranking out;
  out.order = std::move(order);
  // Odds are taken against the leader. One nat does not depose it, and three poses may beat each other in a ring.
  constexpr double kMargin = 1;
  constexpr int kChanges = 3;
  for (int i = 0; i < kChanges; ++i) {
    const std::vector<double> odds = odds_of(scene, all, out.order, elsewhere);
    std::vector<double> value(odds.size());
    for (std::size_t k = 0; k < odds.size(); ++k) value[out.order[k]] = odds[k];
    const std::size_t leader = out.order[0];
    value[leader] = kMargin;
    sort_by(value, out.order);
    value[leader] = 0;
    out.log_odds.clear();
    for (const std::size_t k : out.order) out.log_odds.push_back(std::min(0.0, value[k]));
    if (out.order[0] == leader) break;
  }
  return out;
}

std::vector<std::size_t> in_order(std::size_t n) {
  std::vector<std::size_t> out(n);
  std::iota(out.begin(), out.end(), std::size_t{0});
  return out;
}

}  // namespace

std::vector<double> log_likelihoods(const SceneDepth& scene, Detail detail,
                                    std::span<const std::pair<const Part*, Pose>> poses, int step_px) {
  return likelihoods_of(Predictions(scene, detail, poses, step_px));
}

Ranking rank_again(const SceneDepth& scene, Detail detail, std::span<const std::pair<const Part*, Pose>> poses,
                   int step_px, const CellMask& elsewhere) {
  return rank_by_odds(scene, Predictions(scene, detail, poses, step_px), in_order(poses.size()), elsewhere);
}

Ranking rank_poses(const SceneDepth& scene, Detail detail, std::span<const std::pair<const Part*, Pose>> poses,
                   int step_px) {
  const Predictions all(scene, detail, poses, step_px);
  std::vector<std::size_t> order = in_order(poses.size());
  sort_by(likelihoods_of(all), order);
  return rank_by_odds(scene, all, std::move(order), {});
}

}  // namespace tribin
