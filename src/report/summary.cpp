#include "tribin/report/summary.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

namespace tribin {

Vec3 yaskawa_angles(const Matrix3& r) {
  const double c = std::hypot(r(0, 0), r(1, 0));
  const double ry = std::atan2(-r(2, 0), c);
  if (c < 1e-9) return {0, ry, std::atan2(-r(0, 1), r(1, 1))};
  return {std::atan2(r(2, 1), r(2, 2)), ry, std::atan2(r(1, 0), r(0, 0))};
}

PoseSigma pose_sigma(const Instance& instance, const Vec3& at) {
  // The point at R c + t moves by dt + w x R c.
  const Vec3 arm = instance.camera_from_part.linear() * at;
  Eigen::Matrix<double, 3, 6> j;
  j << 1, 0, 0, 0, arm.z(), -arm.y(),  //
      0, 1, 0, -arm.z(), 0, arm.x(),   //
      0, 0, 1, arm.y(), -arm.x(), 0;
  const Eigen::Matrix<double, 6, 6> covariance = instance.covariance;
  const auto worst = [](const Eigen::Matrix3d& m) {
    return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m).eigenvalues().maxCoeff()));
  };
  return {worst(j * covariance * j.transpose()), worst(covariance.bottomRightCorner<3, 3>())};
}

namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (std::size_t i = 0; i < words.size(); ++i)
    out += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  return out;
}

std::string parts_named(std::span<const Part> parts) {
  std::vector<std::string> names;
  for (const Part& part : parts) names.push_back(part.name);
  return parts.size() == 1 ? names[0] : "none of the " + std::to_string(parts.size()) + " parts";
}

}  // namespace

std::string verdict(const Found& found, std::span<const Part> parts) {
  const auto& items = found.instances.items;
  const std::size_t unsure = found.instances.uncertain.size();
  const std::string rest = unsure == 0   ? ""
                           : unsure == 1 ? "; 1 more stands in a place that is known, in a pose that is not settled"
                                         : "; " + std::to_string(unsure) +
                                               " more stand in places that are known, in poses that are not settled";
  if (items.empty() && unsure > 0) return "No part is given out" + rest;
  if (items.empty()) {
    if (found.status == "empty") return "Nothing is there: no surface is left unexplained";
    if (found.status == "no_data") return "Too little data: see the warnings";
    if (found.status == "time_limit") return "The time ran out before a part was settled";
    return parts.size() == 1 ? "Something is there, but it is not " + parts_named(parts)
                             : "Something is there, but it is " + parts_named(parts);
  }
  std::vector<std::string> words;
  for (const Part& part : parts) {
    const auto count =
        std::count_if(items.begin(), items.end(), [&](const Instance& i) { return i.part == part.name; });
    if (count == 1) words.push_back(part.name);
    if (count > 1) words.push_back(std::to_string(count) + " " + part.name);
  }
  const std::string head = items.size() == 1 ? "1 part found: " : std::to_string(items.size()) + " parts found: ";
  return head + joined(words) + rest;
}

}  // namespace tribin
