#include "io/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

namespace tribin::io {
namespace {

/// Rays x / z or y / z of a cloud.
using Rays = std::vector<double>;

struct Lattice {
  double pitch = 0, offset = 0;  ///< ray = (index + offset) * pitch
  double coherence = 0;          ///< 1 when all rays lie on it, 0 when they lie anywhere
};

Lattice coherence_at(const Rays& rays, double pitch, std::size_t every) {
  std::complex<double> sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < rays.size(); i += every, ++count) sum += std::polar(1.0, 2 * kPi * rays[i] / pitch);
  sum /= static_cast<double>(count);
  return {pitch, std::arg(sum) / (2 * kPi), std::abs(sum)};
}

/// The coarsest lattice that the rays lie on: they also lie on those twice and three times as fine.
Lattice find_lattice(const Rays& rays, double most, double least) {
  const auto [low, high] = std::minmax_element(rays.begin(), rays.end());
  const double span = std::max(std::abs(*low), std::abs(*high));
  const std::size_t every = std::max<std::size_t>(1, rays.size() / 2000);
  constexpr double kFair = 0.7;  // beside the peak, the outermost rays are a sixth of a pixel off
  Lattice best;
  // A step that moves the outermost ray by an eighth of a pixel.
  for (double pitch = most; pitch >= least; pitch -= 0.125 * pitch * pitch / span) {
    const Lattice at = coherence_at(rays, pitch, every);
    if (best.coherence > kFair && at.coherence < 0.5 * best.coherence) break;  // past the first peak
    if (at.coherence > best.coherence) best = at;
  }
  if (best.coherence < kFair) return {};
  for (double step = 0.125 * best.pitch * best.pitch / span; step > 1e-3 * best.pitch * best.pitch / span; step /= 2)
    for (const double pitch : {best.pitch - step, best.pitch + step})
      if (const Lattice at = coherence_at(rays, pitch, 1); at.coherence > best.coherence) best = at;
  return best;
}

int index_of(double ray, const Lattice& lattice) {
  return static_cast<int>(std::lround(ray / lattice.pitch - lattice.offset));
}

}  // namespace

std::optional<RawCloud> regain_grid(const RawCloud& cloud) {
  constexpr std::size_t kLeast = 500;  // fewer may lie on a lattice by chance
  Rays x, y;
  std::size_t behind = 0, holes = 0;
  for (const Vec3f& p : cloud.points) {
    if (is_hole(p)) {
      ++holes;
      continue;
    }
    if (p.z() == 0) return {};
    behind += p.z() < 0;
    x.push_back(double(p.x()) / p.z());
    y.push_back(double(p.y()) / p.z());
  }
  if (x.size() < kLeast || (behind != 0 && behind != x.size())) return {};
  const auto extent = [](const Rays& rays) {
    const auto [low, high] = std::minmax_element(rays.begin(), rays.end());
    return *high - *low;
  };
  // As many pixels as points would fill the box of the rays; holes and cut corners leave the true pitch finer.
  const double full = std::sqrt(extent(x) * extent(y) / static_cast<double>(x.size()));
  if (!(full > 0)) return {};
  const Lattice columns = find_lattice(x, 1.05 * full, 0.4 * full), rows = find_lattice(y, 1.05 * full, 0.4 * full);
  constexpr double kOnLattice = 0.82;  // rays within a tenth of a pixel, as organized clouds are wanted
  if (columns.coherence < kOnLattice || rows.coherence < kOnLattice) return {};
  const auto range = [](const Rays& rays, const Lattice& lattice) {
    const auto [low, high] = std::minmax_element(rays.begin(), rays.end());
    return std::pair{index_of(*low, lattice), index_of(*high, lattice)};
  };
  const auto [u0, u1] = range(x, columns);
  const auto [v0, v1] = range(y, rows);
  RawCloud out = cloud;
  out.width = u1 - u0 + 1, out.height = v1 - v0 + 1;
  // A point in six pixels at least, and no two in one: else it is no picture.
  const auto pixels = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
  if (out.width < 2 || out.height < 2 || pixels > 6 * x.size()) return {};
  out.points.assign(pixels, Vec3f(Vec3f::Constant(std::numeric_limits<float>::quiet_NaN())));
  std::size_t next = 0, twice = 0;
  for (const Vec3f& p : cloud.points) {
    if (is_hole(p)) continue;
    Vec3f& pixel = out.points[static_cast<std::size_t>(index_of(y[next], rows) - v0) * out.width +
                              static_cast<std::size_t>(index_of(x[next], columns) - u0)];
    twice += pixel.allFinite();
    pixel = p;
    ++next;
  }
  if (100 * twice > x.size()) return {};
  out.warnings.push_back("the file has no grid; one of " + std::to_string(out.width) + " x " +
                         std::to_string(out.height) + " pixels was regained from the rays of its points");
  return out;
}

}  // namespace tribin::io
