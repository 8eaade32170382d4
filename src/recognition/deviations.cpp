#include <algorithm>
#include <cmath>

#include "metrology.hpp"
#include "tolerances.hpp"

namespace tribin {
namespace {

constexpr int kHalfWindow =
    4;  // residuals are averaged over 9 x 9 rendered pixels: a third of noise correlated over one

/// What the scan says of a rendered pixel.
enum class State : std::uint8_t { unknown, compared, in_front, behind };

struct Residuals {
  std::vector<State> state;
  std::vector<float> off;    ///< of the scan from the surface, outward positive [mm], bounded at the reach
  std::vector<float> sigma;  ///< its noise
  double reach_mm = 0;       ///< nearer than this an occluder would touch
  int compared = 0;
  int told = 0;  ///< of these, such that hold no other surface's light
};

/// Does depth jump beside this pixel? The border of a hole alone does not make it a mixed one.
bool jumps(const SceneDepth& scene, int u, int v) {
  const float z = scene.z_mm(u, v);
  const float limit = 6 * scene.sigma_mm(u, v) + 4 * z / static_cast<float>(scene.camera.fx);  // slants of 76 deg
  for (const auto& [du, dv] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
    if (!scene.z_mm.contains(u + du, v + dv)) continue;
    if (std::abs(scene.z_mm(u + du, v + dv) - z) > limit) return true;  // false for NaN
  }
  return false;
}

Residuals residuals_of(const Part& part, const SceneDepth& scene, const PartPixels& pixels) {
  const IndexRender& r = pixels.render;
  Residuals out;
  out.reach_mm = 0.03 * part.diameter_mm;  // as in verification: what is farther off is another thing
  out.state.assign(r.triangle.size(), State::unknown);
  out.off.assign(r.triangle.size(), 0);
  out.sigma.assign(r.triangle.size(), 0);
  const auto reach = static_cast<float>(out.reach_mm);
  for (int j = 0; j < r.height; ++j)
    for (int i = 0; i < r.width; ++i) {
      const std::size_t k = r.index(i, j);
      if (!pixels.inner[k]) continue;
      const int u = r.u0 + i * pixels.step, v = r.v0 + j * pixels.step;
      const float z = scene.z_mm(u, v);
      if (!(z > 0) || (scene.near_break(u, v) && jumps(scene, u, v))) continue;
      const Vec3f& n = r.normal[static_cast<std::size_t>(r.triangle[k])];
      const double along = n.cast<double>().dot(scene.camera.ray(u, v));
      if (std::abs(along) < 0.26) continue;  // beyond 75 deg a scanner measures edges and luck
      const auto off = static_cast<float>((z - 1.0 / r.inverse_z[k]) * along);
      const auto sigma = static_cast<float>(std::hypot(scene.sigma_mm(u, v) * along, part.mesh.chord_error_mm));
      const float tau = reach + 5 * sigma;
      out.state[k] = off > tau ? State::in_front : off < -tau ? State::behind : State::compared;
      out.off[k] = std::clamp(off, -tau, tau);
      out.sigma[k] = sigma;
      ++out.compared;
      out.told += !pixels.mirrored[k];
    }
  return out;
}

/// Mean residual over the window about a pixel, of those that were compared.
struct Mean {
  double off = 0, sigma = 0;
  int count = 0;
};

Mean window_mean(const Residuals& residuals, const IndexRender& r, int i, int j, double inflation) {
  Mean out;
  double variance = 0;
  for (int jj = std::max(0, j - kHalfWindow); jj <= std::min(r.height - 1, j + kHalfWindow); ++jj)
    for (int ii = std::max(0, i - kHalfWindow); ii <= std::min(r.width - 1, i + kHalfWindow); ++ii) {
      const std::size_t k = r.index(ii, jj);
      if (residuals.state[k] == State::unknown || residuals.state[k] == State::in_front) continue;
      out.off += residuals.off[k];
      variance += residuals.sigma[k] * residuals.sigma[k];
      ++out.count;
    }
  if (out.count == 0) return out;
  out.off /= out.count;
  out.sigma = std::sqrt(variance / out.count * std::min(1.0, inflation / out.count));
  return out;
}

struct Piece {
  Deviation told;
  double mirrored_share = 0;
};

/// What is said of a connected set of pixels.
Piece describe(const Part& part, const SceneDepth& scene, const PartPixels& pixels, const Instance& instance,
               const Residuals& residuals, const std::vector<std::size_t>& members, double inflation, double ripple) {
  const IndexRender& r = pixels.render;
  Piece out;
  Deviation& d = out.told;
  std::vector<int> votes(part.model.primitives.size() + 1, 0);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double off = 0, variance = 0;
  int behind = 0, mirrored = 0;
  for (std::size_t m = 0; m < members.size(); ++m) {
    const std::size_t k = members[m];
    const int u = r.u0 + static_cast<int>(k % static_cast<std::size_t>(r.width)) * pixels.step;
    const int v = r.v0 + static_cast<int>(k / static_cast<std::size_t>(r.width)) * pixels.step;
    const double z = 1.0 / r.inverse_z[k];
    const Eigen::Vector3d n = r.normal[static_cast<std::size_t>(r.triangle[k])].cast<double>();
    const Eigen::Vector3d ray = scene.camera.ray(u, v), x = ray * z;
    const double pixel_mm2 = z * z / (scene.camera.fx * scene.camera.fy) * pixels.step * pixels.step;
    d.area_mm2 += pixel_mm2 / std::abs(n.dot(ray));
    middle += x;
    off += residuals.off[k];
    variance += residuals.sigma[k] * residuals.sigma[k];
    behind += residuals.state[k] == State::behind;
    ++votes[static_cast<std::size_t>(std::max(0, pixels.primitive(part, k)))];
    mirrored += pixels.mirrored[k];
  }
  const auto count = static_cast<double>(members.size());
  middle /= count;
  d.depth_mm = off / count;
  d.sigma_mm = std::sqrt(variance / count * std::min(1.0, inflation / count) + ripple * ripple);
  d.at_part_mm = instance.camera_from_part.inverse() * Vec3(middle);
  d.primitive = static_cast<int>(std::max_element(votes.begin(), votes.end()) - votes.begin());
  d.kind = 2 * behind > count ? "missing" : d.depth_mm < 0 ? "dent" : "raised";
  out.mirrored_share = mirrored / count;
  return out;
}

}  // namespace

std::vector<Deviation> find_deviations(const Part& part, const SceneDepth& scene, const PartPixels& pixels,
                                       const Instance& instance, double& checked_fraction) {
  const IndexRender& r = pixels.render;
  const Residuals residuals = residuals_of(part, scene, pixels);
  checked_fraction = r.silhouette_pixels ? double(residuals.told) / double(r.silhouette_pixels) : 0;
  std::vector<Deviation> out;
  if (residuals.compared == 0) return out;
  const double inflation =
      std::max(1.0, correlation_inflation(scene.correlation_px) / (double(pixels.step) * pixels.step));
  std::vector<Mean> means(r.triangle.size());
  std::vector<double> sizes;
  for (int j = 0; j < r.height; ++j)
    for (int i = 0; i < r.width; ++i) {
      const std::size_t k = r.index(i, j);
      if (residuals.state[k] == State::unknown || residuals.state[k] == State::in_front) continue;
      means[k] = window_mean(residuals, r, i, j, inflation);
      sizes.push_back(std::abs(means[k].off));
    }
  if (sizes.empty()) return out;
  // What this sensor gets wrong on this part without being noise (shine, warp, edges of others): the middle one of the
  // windows. Half of a part may be damaged before it hides itself.
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  const double ripple = 1.4826 * *middle;
  const double form = form_tolerance_mm(part.diameter_mm);

  // +1 above the surface, -1 below it, 0 at it or not told. An occluder is above too, so that its foot goes with it.
  std::vector<std::int8_t> side(r.triangle.size(), 0);
  for (int j = 0; j < r.height; ++j)
    for (int i = 0; i < r.width; ++i) {
      const std::size_t k = r.index(i, j);
      if (residuals.state[k] == State::in_front) side[k] = 1;
      if (means[k].count == 0) continue;
      // Not what the pose leaves open: it has settled on these very points, and moves whole faces.
      const double sigma = std::max(means[k].sigma, ripple);
      if (std::abs(means[k].off) > form + 4 * sigma) side[k] = means[k].off > 0 ? 1 : -1;
    }
  // Connected pieces. Smaller than a hundredth of what is seen, or than a window, is chance.
  constexpr int kWindow = (2 * kHalfWindow + 1) * (2 * kHalfWindow + 1);
  const auto least = std::max<double>(kWindow, 0.01 * residuals.compared);
  std::vector<std::size_t> members;
  std::vector<bool> done(r.triangle.size(), false);
  for (std::size_t first = 0; first < side.size(); ++first) {
    if (side[first] == 0 || done[first]) continue;
    members.assign(1, first);
    done[first] = true;
    bool another_thing = false;
    for (std::size_t m = 0; m < members.size(); ++m) {
      const std::size_t k = members[m];
      another_thing |= residuals.state[k] == State::in_front;
      const auto i = static_cast<int>(k % static_cast<std::size_t>(r.width)),
                 j = static_cast<int>(k / static_cast<std::size_t>(r.width));
      for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (i + di < 0 || j + dj < 0 || i + di >= r.width || j + dj >= r.height) continue;
        const std::size_t next = r.index(i + di, j + dj);
        if (done[next] || side[next] != side[first]) continue;
        done[next] = true;
        members.push_back(next);
      }
    }
    // What lies on the part or before it is no fault of it.
    if (another_thing || static_cast<double>(members.size()) < least) continue;
    const Piece piece = describe(part, scene, pixels, instance, residuals, members, inflation, ripple);
    if (piece.mirrored_share > 0.25) continue;  // may be another surface's light, or a ghost in the shadow
    out.push_back(piece.told);
  }
  // Fringes of two surfaces that add up leave ridges beside furrows; what is pressed in or broken off leaves no ridges.
  if (pixels.shiny) {
    double above = 0, below = 0;
    for (const Deviation& d : out) (d.depth_mm > 0 ? above : below) += d.kind == "missing" ? 0 : d.area_mm2;
    std::erase_if(out, [&](const Deviation& d) {
      return d.kind != "missing" && (d.depth_mm > 0 ? below : above) > 0.25 * d.area_mm2;
    });
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Deviation& a, const Deviation& b) { return a.area_mm2 > b.area_mm2; });
  return out;
}

}  // namespace tribin
