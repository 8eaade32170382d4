#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin::surfel_detail {

/// A k-d tree over loose points; queries may run in parallel. The points must outlive it.
class PointTree {
 public:
  explicit PointTree(std::span<const Vec3f> points);
  ~PointTree();
  PointTree(const PointTree&) = delete;
  PointTree& operator=(const PointTree&) = delete;

  /// The k points nearest to `at`, nearest first; equal distances in order of their numbers. Fewer where there are
  /// fewer.
  void nearest(const Vec3f& at, std::size_t k, std::vector<std::uint32_t>& out) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace tribin::surfel_detail
