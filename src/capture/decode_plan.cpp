#include "capture/decode_plan.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "tribin/core/error.hpp"
#include "tribin/core/geometry.hpp"

namespace tribin::capture_detail {
namespace {

[[noreturn]] void no_set(const std::string& name, const std::string& seen, const std::string& wanted) {
  throw Error(ErrorCode::bad_input, name + ": pattern set: saw " + seen + ", wanted " + wanted);
}

std::string text(double value) {
  std::string out = std::to_string(value);
  out.erase(out.find_last_not_of('0') + 1);
  if (out.back() == '.') out.pop_back();
  return out;
}

/// Rows of the pseudo-inverse of [1, cos shift, -sin shift].
void weigh(Fringe& fringe, const std::string& name) {
  Eigen::MatrixXd a(static_cast<Eigen::Index>(fringe.images.size()), 3);
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const double shift = fringe.images[static_cast<std::size_t>(i)].shift;
    a.row(i) << 1, std::cos(shift), -std::sin(shift);
  }
  const Eigen::Matrix3d normal = a.transpose() * a;
  // Equal shifts have determinant N^3 / 4; a tenth of it still gives usable phases.
  if (normal.determinant() < 0.025 * std::pow(static_cast<double>(a.rows()), 3))
    no_set(name, "phase shifts of period " + text(fringe.period) + " px that lie too close together",
           "three or more that spread over the turn");
  const Eigen::MatrixXd inverse = normal.inverse() * a.transpose();
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    fringe.images[static_cast<std::size_t>(i)].weights = {
        static_cast<float>(inverse(0, i)), static_cast<float>(inverse(1, i)), static_cast<float>(inverse(2, i))};
}

/// All fringes and their beats, from the coarsest to the finest fringe, each as much finer as five sigma of usable
/// phases allow.
void plan_chain(AxisPlan& plan, const std::string& name) {
  std::vector<Wave> waves;
  const int count = static_cast<int>(plan.fringes.size());
  for (int a = 0; a < count; ++a)
    for (int b = a + 1; b < count; ++b) {
      const double pa = plan.fringes[a].period, pb = plan.fringes[b].period;
      waves.push_back({a, b, pa * pb / (pb - pa)});
    }
  for (int a = 1; a < count; ++a) waves.push_back({a, -1, plan.fringes[a].period});
  std::sort(waves.begin(), waves.end(), [](const Wave& p, const Wave& q) {
    return p.period != q.period ? p.period > q.period : p.a != q.a ? p.a < q.a : p.b < q.b;
  });
  constexpr double kRatio = 10;  // algorithms: sd of a beat's order at phase noise 0.05 rad is 0.11 turns at ratio 10
  plan.chain = {waves[0]};
  const double finest = plan.fringes[0].period;
  while (plan.chain.back().period > kRatio * finest) {
    const Wave* next = nullptr;
    for (const Wave& wave : waves)
      if (wave.period < plan.chain.back().period * 0.999 && wave.period * kRatio >= plan.chain.back().period)
        next = &wave;
    // Equal ratios are best: of the waves within reach the one nearest to the middle of what is left, but one at least.
    const double left = plan.chain.back().period / finest;
    const double ideal = plan.chain.back().period / std::pow(left, 1 / std::ceil(std::log(left) / std::log(5.2)));
    for (const Wave& wave : waves)
      if (wave.period < plan.chain.back().period * 0.999 && wave.period * kRatio >= plan.chain.back().period &&
          std::abs(std::log(wave.period / ideal)) < std::abs(std::log(next->period / ideal)))
        next = &wave;
    if (!next)
      no_set(name,
             "fringe periods whose beat of " + text(plan.chain.back().period) + " px has no finer one above a tenth",
             "Gray code, or periods whose beats lead down to the finest fringe");
    plan.chain.push_back(*next);
  }
}

void plan_gray(AxisPlan& plan, const std::vector<Pattern>& patterns, const std::string& name) {
  std::map<double, BitImage, std::greater<>> bits;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const Pattern& p = patterns[i];
    if (p.axis != plan.axis || p.kind != PatternKind::gray) continue;
    if (!bits.try_emplace(p.period_px, BitImage{static_cast<int>(i), -1}).second)
      no_set(name, "two Gray images of words of " + text(p.period_px) + " px", "one for each bit (and exposure)");
  }
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const Pattern& p = patterns[i];
    if (p.axis != plan.axis || p.kind != PatternKind::gray_inverse) continue;
    const auto found = bits.find(p.period_px);
    if (found == bits.end())
      no_set(name, "an inverse Gray image of words of " + text(p.period_px) + " px alone", "its Gray image too");
    found->second.inverse = static_cast<int>(i);
  }
  double before = 0;
  for (const auto& [period, bit] : bits) {
    if (before > 0 && std::abs(before / period - 2) > 1e-6)
      no_set(name, "Gray words of " + text(before) + " px and then " + text(period) + " px",
             "each half the one before");
    plan.bits.push_back(bit);
    before = period;
  }
  if (plan.bits.size() > 16) no_set(name, std::to_string(plan.bits.size()) + " Gray bits", "at most 16");
  plan.words_per_fringe = plan.fringes[0].period / before;
  const double power = std::log2(plan.words_per_fringe);
  if (std::abs(power - std::round(power)) > 1e-6 || power < -1e-6)
    no_set(name, "Gray words of " + text(before) + " px at fringes of " + text(plan.fringes[0].period) + " px",
           "words as wide as the fringe, or a half, a quarter .. of it");
}

AxisPlan plan_axis(const std::vector<Pattern>& patterns, PatternAxis axis, const std::string& name) {
  AxisPlan plan;
  plan.axis = axis;
  std::map<double, Fringe> fringes;
  bool gray = false;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const Pattern& p = patterns[i];
    if (p.axis != axis || p.kind == PatternKind::white || p.kind == PatternKind::black) continue;
    gray |= p.kind != PatternKind::phase;
    if (p.kind != PatternKind::phase) continue;
    Fringe& fringe = fringes[p.period_px];
    fringe.period = p.period_px;
    fringe.images.push_back({static_cast<int>(i), p.shift_rad, {}});
  }
  if (fringes.empty() && !gray) return plan;
  for (auto& [period, fringe] : fringes) {
    if (fringe.images.size() >= 3) {
      weigh(fringe, name);
      plan.fringes.push_back(fringe);
    } else {
      for (const PhaseImage& image : fringe.images) plan.singles.push_back({image.image, period, image.shift, {}});
    }
  }
  const std::string along = std::string(name_of(axis)) + " patterns ";
  if (plan.fringes.empty()) no_set(name, along + "without three phase images of one period", "three or more");
  const double steps = static_cast<double>(plan.fringes[0].images.size());
  plan.noise_factor = plan.fringes[0].period / (2 * kPi) * std::sqrt(2 / steps);
  if (gray) {
    plan_gray(plan, patterns, name);
    return plan;
  }
  if (plan.fringes.size() == 1 && plan.singles.size() >= 2) {
    double coarsest = 0;  // the beat with the nearest period is the range
    for (const SingleImage& s : plan.singles)
      coarsest = std::max(coarsest, s.period * plan.fringes[0].period / std::abs(s.period - plan.fringes[0].period));
    plan.orders = static_cast<int>(std::lround(coarsest / plan.fringes[0].period));
    for (SingleImage& s : plan.singles)
      for (int k = 0; k < plan.orders; ++k) {
        const double turn = 2 * kPi * k * plan.fringes[0].period / s.period;
        s.turns.emplace_back(static_cast<float>(std::cos(turn)), static_cast<float>(std::sin(turn)));
      }
    return plan;
  }
  if (plan.fringes.size() < 2)
    no_set(name, along + "of one period without Gray images", "Gray images, or phase images of two periods or more");
  plan_chain(plan, name);
  plan.noise_factor /= std::sqrt(static_cast<double>(plan.fringes.size()));
  return plan;
}

}  // namespace

DecodePlan plan_decoding(const std::vector<Pattern>& patterns, const std::string& name) {
  DecodePlan plan;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    if (patterns[i].kind == PatternKind::white) plan.white = static_cast<int>(i);
    if (patterns[i].kind == PatternKind::black) plan.black = static_cast<int>(i);
  }
  for (const PatternAxis axis : {PatternAxis::column, PatternAxis::row}) {
    AxisPlan one = plan_axis(patterns, axis, name);
    if (!one.fringes.empty()) plan.axes.push_back(std::move(one));
  }
  if (plan.axes.empty())
    no_set(name, "no phase images", "three or more of one period, and Gray images or more periods");
  return plan;
}

}  // namespace tribin::capture_detail
