#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "capture/hand_eye_solve.hpp"
#include "tribin/core/error.hpp"

namespace tribin::hand_eye_detail {
namespace {

// Chi-square of 3 and of 6 degrees of freedom: the median, and what one good pair in 10,000 exceeds.
constexpr double kMedian3 = 2.366, kMedian6 = 5.348, kLimit3 = 21.11, kLimit6 = 27.86;
// No controller prints poses finer than a twentieth of the noise of its robot: below that, residuals are rounding.
constexpr double kLeastVarianceFactor = 0.05 * 0.05;
// 600 starts of 3 (of 5) pairs out of which 2 in 5 are wrong: 130 (47) of them are all good.
constexpr int kStarts = 600;
constexpr int kKept = 10;

/// How many pairs the majority has: 3 in 5, where there are enough of them to tell; else all.
int majority(const Equations& equations) {
  const int n = equations.size();
  return n < (equations.sphere() ? 8 : 6) ? n : n - (2 * n) / 5;
}

/// All subsets of the size, or kStarts drawn ones where there are more.
std::vector<Indices> subsets(int n, int size) {
  std::vector<Indices> out;
  Indices subset(size);
  std::iota(subset.begin(), subset.end(), 0);
  while (static_cast<int>(out.size()) <= kStarts) {
    out.push_back(subset);
    int k = size - 1;
    while (k >= 0 && subset[k] == n - size + k) --k;
    if (k < 0) return out;
    ++subset[k];
    for (int m = k + 1; m < size; ++m) subset[m] = subset[m - 1] + 1;
  }
  out.clear();
  std::mt19937 random(1);  // its raw numbers are the same everywhere
  Indices all(n);
  std::iota(all.begin(), all.end(), 0);
  for (int draw = 0; draw < kStarts; ++draw) {
    for (int k = 0; k < size; ++k)
      std::swap(all[k], all[k + static_cast<int>(random() % static_cast<unsigned>(n - k))]);
    out.emplace_back(all.begin(), all.begin() + size);
  }
  return out;
}

/// The chi-square (in units of the variance factor) that one good pair in 10,000 exceeds, where the factor is estimated
/// from `dof` degrees of freedom (F in place of chi-square: dof / (dof - 9) holds F(3 to 6, dof) at 1e-4 within 10 %
/// from 25 on, and is on the safe side below) and the pair is predicted by a fit that it has no share in (unknowns /
/// dof).
double outlier_limit(const Equations& equations, double dof) {
  const double limit = equations.sphere() ? kLimit3 : kLimit6;
  return limit * dof / std::max(1.0, dof - 9) * (1 + equations.unknowns() / dof);
}

struct Ranking {
  Indices best;    ///< the h pairs that fit best, rising
  double sum = 0;  ///< of their chi2
  std::vector<double> chi2;
};

Ranking rank(const Equations& equations, const Solution& solution, int h) {
  Ranking out;
  for (int i = 0; i < equations.size(); ++i) out.chi2.push_back(equations.chi2(solution, i, i));
  out.best.resize(equations.size());
  std::iota(out.best.begin(), out.best.end(), 0);
  std::stable_sort(out.best.begin(), out.best.end(), [&](int a, int b) { return out.chi2[a] < out.chi2[b]; });
  out.best.resize(h);
  for (int i : out.best) out.sum += out.chi2[i];
  std::sort(out.best.begin(), out.best.end());
  return out;
}

/// Least trimmed squares: fit the pairs that fit best until they stay the same.
Ranking concentrate(const Equations& equations, Solution& solution, Ranking ranking, int h) {
  for (int round = 0; round < 10; ++round) {
    const Solution next = equations.refine(ranking.best, solution);
    Ranking again = rank(equations, next, h);
    if (!(again.sum < ranking.sum)) break;
    solution = next;
    const bool same = again.best == ranking.best;
    ranking = std::move(again);
    if (same) break;
  }
  return ranking;
}

}  // namespace

Consensus find_consensus(const Equations& equations) {
  const int h = majority(equations), n = equations.size(), k = equations.residuals_per_pair();
  const int smallest = equations.sphere() ? 5 : 3;
  struct Candidate {
    Solution solution;
    Ranking ranking;
  };
  std::vector<Candidate> candidates;
  std::vector<Indices> starts = h < n ? subsets(n, smallest) : std::vector<Indices>{};
  starts.emplace_back(n);  // all of them: the best start where none is wrong
  std::iota(starts.back().begin(), starts.back().end(), 0);
  for (const Indices& use : starts) {
    Candidate candidate;
    if (!equations.start(use, candidate.solution)) continue;
    candidate.ranking = rank(equations, candidate.solution, h);
    if (std::isfinite(candidate.ranking.sum)) candidates.push_back(std::move(candidate));
  }
  if (candidates.empty())
    throw Error(ErrorCode::too_little_data,
                "hand-eye: saw robot poses that turn about one axis only, or camera poses that do not turn with them; "
                "wanted turns about two axes, 15 deg apart or more");
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.ranking.sum < b.ranking.sum; });
  candidates.resize(std::min<std::size_t>(candidates.size(), kKept));
  for (Candidate& c : candidates) c.ranking = concentrate(equations, c.solution, std::move(c.ranking), h);
  const Candidate& best =
      *std::min_element(candidates.begin(), candidates.end(),
                        [](const Candidate& a, const Candidate& b) { return a.ranking.sum < b.ranking.sum; });

  // From the majority outwards: all that fits by the noise that the fit itself shows.
  const double median = equations.sphere() ? kMedian3 : kMedian6;
  const auto degrees_of_freedom = [&](std::size_t used) {
    return std::max(1.0, static_cast<double>(k * used) - equations.unknowns());
  };
  std::vector<double> sorted = best.ranking.chi2;
  std::nth_element(sorted.begin(), sorted.begin() + n / 2, sorted.end());
  Consensus out{best.solution, best.ranking.best, 1, 0};
  double dof = degrees_of_freedom(h), factor = sorted[n / 2] / median * k * h / dof;
  for (int round = 0; round < 20; ++round) {
    const double limit = outlier_limit(equations, dof) * std::max(factor, kLeastVarianceFactor);
    const Ranking ranking = rank(equations, out.solution, h);
    Indices used;
    for (int i = 0; i < n; ++i)
      if (h == n || ranking.chi2[i] < limit) used.push_back(i);
    if (static_cast<int>(used.size()) < h) used = ranking.best;
    out.solution = equations.refine(used, out.solution);
    double sum = 0;
    for (int i : used) sum += equations.chi2(out.solution, i, i);
    dof = degrees_of_freedom(used.size());
    factor = sum / dof;
    const bool same = round > 0 && used == out.used;
    out.used = std::move(used);
    if (same) break;
  }
  out.variance_factor = factor;
  out.outlier_chi2 = outlier_limit(equations, dof) * std::max(factor, kLeastVarianceFactor);
  return out;
}

}  // namespace tribin::hand_eye_detail
