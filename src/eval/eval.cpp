#include "tribin/eval/eval.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tribin/core/error.hpp"

namespace tribin::eval {
namespace {

/// The part_from_part motions to try so that truth * S comes close to the answer: every discrete one, each with the
/// turn about the continuous axis that leaves the least rotation.
std::vector<Pose> symmetries_near(const Model& model, const Pose& answer, const Pose& truth) {
  std::vector<Pose> discrete = model.symmetry.discrete;
  if (discrete.empty()) discrete.push_back(Pose::Identity());
  if (model.symmetry.continuous.empty()) return discrete;
  std::vector<Pose> out;
  for (const ContinuousSymmetry& symmetry : model.symmetry.continuous) {
    for (const Pose& d : discrete) {
      const Matrix3 rest = (truth * d).linear().transpose() * answer.linear();
      const Eigen::Quaterniond q(rest);
      const Vec3 axis = symmetry.axis.normalized();
      const double angle = 2 * std::atan2(q.vec().dot(axis), q.w());
      const Matrix3 turn = rotation_from_vector(axis * angle);
      Pose s = Pose::Identity();
      s.linear() = turn;
      s.translation() = symmetry.point - turn * symmetry.point;
      out.push_back(d * s);
    }
  }
  return out;
}

double farthest_mm(const Model& model, const Pose& a, const Pose& b) {
  const Matrix3 turn = a.linear() - b.linear();
  const Vec3 shift = a.translation() - b.translation();
  double worst = 0;
  for (const Vec3f& v : model.vertices) worst = std::max(worst, (turn * v.cast<double>() + shift).squaredNorm());
  return std::sqrt(worst);
}

const Model& model_named(std::span<const Model> models, const std::string& name) {
  for (const Model& model : models)
    if (model.name == name) return model;
  throw Error(ErrorCode::bad_input, "no model is named '" + name + "' among those to judge by");
}

}  // namespace

PoseError pose_error(const Model& model, const Pose& answer, const Pose& truth) {
  PoseError best;
  bool first = true;
  for (const Pose& s : symmetries_near(model, answer, truth)) {
    const Pose target = truth * s;
    const double mssd = farthest_mm(model, answer, target);
    if (!first && mssd >= best.mssd_mm) continue;
    first = false;
    best.mssd_mm = mssd;
    best.translation_axes_mm = answer * model.box_center - target * model.box_center;
    best.translation_mm = best.translation_axes_mm.norm();
    best.rotation_axes = vector_from_rotation(answer.linear() * target.linear().transpose());
    best.rotation = best.rotation_axes.norm();
  }
  return best;
}

Judgement judge(std::span<const Instance> answers, std::span<const Truth> truths, std::span<const Model> models,
                double min_visible) {
  std::vector<int> order(answers.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return answers[a].score > answers[b].score; });

  Judgement out;
  std::vector<char> taken(truths.size(), 0);
  for (int a : order) {
    const Instance& answer = answers[a];
    int best = -1;
    PoseError best_error;
    for (std::size_t t = 0; t < truths.size(); ++t) {
      if (taken[t] || truths[t].part != answer.part) continue;
      const Model& model = model_named(models, answer.part);
      const PoseError error = pose_error(model, answer.camera_from_part, truths[t].camera_from_part);
      if (error.mssd_mm >= 0.05 * model.diameter_mm) continue;
      if (best < 0 || error.mssd_mm < best_error.mssd_mm) {
        best = static_cast<int>(t);
        best_error = error;
      }
    }
    if (best < 0) {
      out.false_answers.push_back(a);
      continue;
    }
    taken[best] = 1;
    if (truths[best].visible_fraction >= min_visible) out.found.push_back({a, best, best_error});
  }
  for (std::size_t t = 0; t < truths.size(); ++t) {
    if (truths[t].visible_fraction < min_visible) continue;
    ++out.asked;
    if (!taken[t]) out.missed.push_back(static_cast<int>(t));
  }
  return out;
}

Model model_of(const Part& part) {
  Model out;
  out.name = part.name;
  out.vertices = part.mesh.vertices;
  out.diameter_mm = part.diameter_mm;
  out.box_center = part.box_center();
  out.symmetry = part.symmetry;
  return out;
}

double overlap(const Model& model, const Pose& a, const Pose& b, double limit_mm) {
  constexpr std::size_t kAsked = 400;  // points: a share of 0.5 is known to 0.05
  const Pose from_b = a.inverse() * b;
  const std::size_t asked = std::min(kAsked, model.surface.size());
  std::size_t near = 0;
  for (std::size_t i = 0; i < asked; ++i) {
    const Vec3f p = (from_b * model.surface[i].cast<double>()).cast<float>();
    const float limit = static_cast<float>(limit_mm * limit_mm);
    near += std::any_of(model.surface.begin(), model.surface.end(),
                        [&](const Vec3f& q) { return (p - q).squaredNorm() < limit; });
  }
  return asked > 0 ? static_cast<double>(near) / static_cast<double>(asked) : 0;
}

std::vector<Vec3f> points_on(const Mesh& mesh, int count, std::vector<Vec3f>* normals) {
  std::vector<double> area_before;
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
               c = mesh.vertices[t[2]].cast<double>();
    area_before.push_back(area);
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  if (!(area > 0)) return {};
  const auto radical_inverse = [](unsigned base, unsigned i) {
    double value = 0, digit = 1.0 / base;
    for (; i > 0; i /= base, digit /= base) value += digit * (i % base);
    return value;
  };
  std::vector<Vec3f> out;
  for (unsigned i = 1; i <= static_cast<unsigned>(count); ++i) {
    const auto after = std::upper_bound(area_before.begin(), area_before.end(), area * radical_inverse(2, i));
    const auto& t = mesh.triangles[static_cast<std::size_t>(after - area_before.begin()) - 1];
    const float root = static_cast<float>(std::sqrt(radical_inverse(3, i))),
                v = static_cast<float>(radical_inverse(5, i));
    const Vec3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    out.push_back((1 - root) * a + root * (1 - v) * b + root * v * c);
    if (normals) normals->push_back((b - a).cross(c - a).normalized());
  }
  return out;
}

Share share_of(int count, int of) {
  if (of <= 0) return {count, of, 0, 1};
  const double z = 1.959964, n = of, p = count / n;  // z: two-sided 95 %
  const double middle = (p + z * z / (2 * n)) / (1 + z * z / n);
  const double half = z / (1 + z * z / n) * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {count, of, std::max(0.0, middle - half), std::min(1.0, middle + half)};
}

Estimate quantile_estimate(const std::vector<double>& values, double q) {
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  const double n = static_cast<double>(sorted.size());
  Estimate out{quantile(sorted, q), 0, std::numeric_limits<double>::infinity(), static_cast<int>(sorted.size())};
  const double half = 1.959964 * std::sqrt(n * q * (1 - q));
  const double low = std::floor(n * q - half) - 1, high = std::ceil(n * q + half);  // ranks from 0
  if (low >= 0) out.low = sorted[static_cast<std::size_t>(low)];
  if (high < n) out.high = sorted[static_cast<std::size_t>(high)];
  return out;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double place = q * (values.size() - 1);
  const std::size_t low = static_cast<std::size_t>(place), high = std::min(low + 1, values.size() - 1);
  return values[low] + (place - low) * (values[high] - values[low]);
}

}  // namespace tribin::eval
