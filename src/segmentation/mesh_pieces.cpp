#include "segmentation/mesh_pieces.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace tribin::segmentation_detail {

bool is_ring(const Surfels& s, const Indices& support) {
  Vec3 mean = Vec3::Zero();
  Matrix3 second = Matrix3::Zero();
  double noise = 0;
  for (std::uint32_t i : support) {
    const Vec3 n = s.normal[i].cast<double>();
    mean += n / static_cast<double>(support.size());
    second += n * n.transpose() / static_cast<double>(support.size());
    noise += s.sigma_normal[i] / static_cast<double>(support.size());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver{Eigen::Matrix3d(second - mean * mean.transpose())};
  return std::sqrt(std::max(0.0, solver.eigenvalues()[0])) < 0.5 * noise;
}

void add_neighbourhoods(Scene& scene, std::vector<Indices>& components) {
  constexpr std::size_t kFacets = 24, kMost = 40;  // of a neighbourhood; neighbourhoods of a component
  const Surfels& s = scene.surfels;
  const std::size_t whole = components.size();
  for (std::size_t c = 0; c < whole; ++c) {
    Indices by_area = components[c];
    if (by_area.size() < 2 * kFacets) continue;
    const std::uint32_t waiting = ++scene.tick;
    for (std::uint32_t i : by_area) scene.mark[i] = waiting;
    std::stable_sort(by_area.begin(), by_area.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return s.area_mm2[a] > s.area_mm2[b]; });
    for (std::size_t at = 0, seeds = 0; at < by_area.size() && seeds < kMost; ++at) {
      if (scene.mark[by_area[at]] != waiting) continue;
      Indices near = {by_area[at]};
      scene.mark[near[0]] = waiting - 1;
      for (std::size_t k = 0; k < near.size() && near.size() < kFacets; ++k)
        for (std::uint32_t n = s.neighbour_begin[near[k]]; n < s.neighbour_begin[near[k] + 1]; ++n)
          if (scene.mark[s.neighbours[n]] == waiting) {
            scene.mark[s.neighbours[n]] = waiting - 1;
            near.push_back(s.neighbours[n]);
          }
      components.push_back(std::move(near));
      ++seeds;
    }
  }
}

}  // namespace tribin::segmentation_detail
