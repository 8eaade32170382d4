#include "tribin/eval/figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <set>

namespace tribin::eval {
namespace {

bool right(const JudgedAnswer& answer) { return !is_false(answer.verdict); }

/// 95 % interval of a statistic by drawing its data again; the same draws each time.
Estimate bootstrap(int count, const std::function<double(const std::vector<int>&)>& statistic) {
  std::vector<int> chosen(static_cast<std::size_t>(count));
  std::iota(chosen.begin(), chosen.end(), 0);
  Estimate out{count > 0 ? statistic(chosen) : 0, 0, 0, count};
  if (count == 0) return out;
  constexpr int kDraws = 400;  // the 2.5 % quantile is then known to a third of its own distance from the median
  std::uint64_t state = 1;
  std::vector<double> values;
  for (int draw = 0; draw < kDraws; ++draw) {
    for (int& i : chosen) {
      state = state * 6364136223846793005u + 1442695040888963407u;  // Knuth's MMIX generator
      i = static_cast<int>((state >> 33) % static_cast<std::uint64_t>(count));
    }
    values.push_back(statistic(chosen));
  }
  out.low = quantile(values, 0.025);
  out.high = quantile(values, 0.975);
  return out;
}

Estimate rms_estimate(const std::vector<double>& values) {
  return bootstrap(static_cast<int>(values.size()), [&](const std::vector<int>& chosen) {
    double sum = 0;
    for (const int i : chosen) sum += values[i] * values[i];
    return std::sqrt(sum / static_cast<double>(chosen.size()));
  });
}

/// Ten bins of equal count along the score.
std::vector<std::vector<int>> bins_of(const std::vector<JudgedAnswer>& answers, std::vector<int> chosen) {
  std::stable_sort(chosen.begin(), chosen.end(), [&](int a, int b) { return answers[a].score < answers[b].score; });
  constexpr std::size_t kBins = 10;
  std::vector<std::vector<int>> bins(kBins);
  for (std::size_t i = 0; i < chosen.size(); ++i) bins[i * kBins / chosen.size()].push_back(chosen[i]);
  return bins;
}

double calibration_error(const std::vector<JudgedAnswer>& answers, const std::vector<int>& chosen) {
  double sum = 0;
  for (const std::vector<int>& bin : bins_of(answers, chosen)) {
    double difference = 0;
    for (const int a : bin) difference += answers[a].score - right(answers[a]);
    sum += std::abs(difference);
  }
  return sum / static_cast<double>(chosen.size());
}

/// Mean of the calibration error of scores that are true probabilities: the mean of |right - expected| in each bin.
double calibration_floor(const std::vector<JudgedAnswer>& answers, const std::vector<int>& chosen) {
  double sum = 0;
  for (const std::vector<int>& bin : bins_of(answers, chosen)) {
    double variance = 0;
    for (const int a : bin) variance += std::max(0.0, answers[a].score * (1 - answers[a].score));
    sum += std::sqrt(2 / kPi * variance);
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, chosen.size()));
}

/// 95 % quantiles of chi-square, by the degrees of freedom.
constexpr std::array<double, 7> kChiSquare95 = {0, 3.8415, 5.9915, 7.8147, 9.4877, 11.0705, 12.5916};

Share covered(const Judged& judged, const std::function<bool(const JudgedAnswer&)>& wanted) {
  int inside = 0, count = 0;
  for (const JudgedAnswer& answer : judged.answers) {
    if (!right(answer) || answer.rank <= 0 || !wanted(answer)) continue;
    ++count;
    inside += answer.chi_square <= kChiSquare95[static_cast<std::size_t>(answer.rank)];
  }
  return share_of(inside, count);
}

std::set<std::string> values_of(const Judged& judged, const std::function<std::string(const JudgedTruth&)>& of_truth,
                                const std::function<std::string(const JudgedAnswer&)>& of_answer) {
  std::set<std::string> out;
  for (const JudgedTruth& truth : judged.truths) out.insert(of_truth(truth));
  for (const JudgedAnswer& answer : judged.answers) out.insert(of_answer(answer));
  out.erase("");
  return out;
}

std::set<std::string> levels_of(const Judged& judged) {
  return values_of(
      judged, [](const JudgedTruth& t) { return t.level; }, [](const JudgedAnswer& a) { return a.level; });
}

std::set<std::string> parts_of(const Judged& judged) {
  return values_of(
      judged, [](const JudgedTruth& t) { return t.part; }, [](const JudgedAnswer& a) { return a.part; });
}

/// Found, of the parts that show 40 %, by answers with at least this score.
Share given_above(const Judged& judged, double score) {
  int found = 0, asked = 0;
  for (const JudgedTruth& truth : judged.truths) {
    if (truth.visible < 0.4) continue;
    ++asked;
    found += truth.answer >= 0 && judged.answers[truth.answer].score >= score;
  }
  return share_of(found, asked);
}

/// The least score above which at most 1 % of the answers are false; above 1 where there is none.
double score_at_risk(const Judged& judged) {
  std::vector<std::pair<double, bool>> sorted;
  for (const JudgedAnswer& answer : judged.answers) sorted.emplace_back(answer.score, !right(answer));
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a > b; });
  double out = 2;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    wrong += sorted[i].second;
    const bool last_of_equals = i + 1 == sorted.size() || sorted[i + 1].first < sorted[i].first;
    if (last_of_equals && 100 * wrong <= i + 1) out = sorted[i].first;
  }
  return out;
}

}  // namespace

Figures figures_of(const Judged& judged, const std::string& name,
                   const std::function<bool(const std::string&, const std::string&)>& wanted) {
  Figures out;
  out.name = name;
  int asked_40 = 0, found_40 = 0, asked_70 = 0, found_70 = 0, withheld = 0;
  int told_40 = 0, told_found = 0, told_withheld = 0;
  for (const JudgedTruth& truth : judged.truths) {
    if (!wanted(truth.level, truth.part)) continue;
    asked_40 += truth.visible >= 0.4, found_40 += truth.visible >= 0.4 && truth.answer >= 0;
    withheld += truth.visible >= 0.4 && truth.withheld;
    if (truth.visible >= 0.4 && truth.in_view)
      ++told_40, told_found += truth.answer >= 0, told_withheld += truth.withheld;
    asked_70 += truth.visible >= 0.7, found_70 += truth.visible >= 0.7 && truth.answer >= 0;
  }
  out.recall_40 = share_of(found_40, asked_40);
  out.recall_70 = share_of(found_70, asked_70);
  out.withheld = share_of(withheld, asked_40);
  out.recall_told = share_of(told_found, told_40);
  out.withheld_told = share_of(told_withheld, told_40);
  int given = 0, wrong = 0, right_ones = 0, undecided = 0;
  std::vector<double> mm, deg, ratio_mm, ratio_deg;
  for (const JudgedAnswer& answer : judged.answers) {
    if (!wanted(answer.level, answer.part)) continue;
    ++given;
    ++out.verdicts[static_cast<int>(answer.verdict)];
    wrong += !right(answer);
    out.told += answer.told;
    right_ones += right(answer), undecided += right(answer) && answer.alternatives > 0;
    if (answer.verdict != Verdict::found) continue;
    mm.push_back(answer.error.translation_mm);
    deg.push_back(answer.error.rotation / kDegree);
    if (answer.bound_mm <= 0) continue;
    ratio_mm.push_back(answer.error.translation_mm / answer.bound_mm);
    ratio_deg.push_back(answer.error.rotation / answer.bound_rotation);
  }
  out.false_share = share_of(wrong, given);
  out.flips = share_of(out.verdicts[static_cast<int>(Verdict::flip)], given);
  out.confusions = share_of(out.verdicts[static_cast<int>(Verdict::wrong_class)], given);
  out.undecided = share_of(undecided, right_ones);
  out.median_mm = quantile_estimate(mm, 0.5);
  out.high_mm = quantile_estimate(mm, 0.95);
  out.median_deg = quantile_estimate(deg, 0.5);
  out.high_deg = quantile_estimate(deg, 0.95);
  out.bound_ratio_mm = quantile_estimate(ratio_mm, 0.5);
  out.bound_ratio_deg = quantile_estimate(ratio_deg, 0.5);
  out.bound_rms_mm = rms_estimate(ratio_mm);
  out.bound_rms_deg = rms_estimate(ratio_deg);
  return out;
}

std::vector<Figures> all_figures(const Judged& judged) {
  std::vector<Figures> out = {figures_of(judged, "all", [](const auto&, const auto&) { return true; })};
  for (const std::string& level : levels_of(judged))
    out.push_back(figures_of(judged, "level " + level, [&](const auto& l, const auto&) { return l == level; }));
  for (const std::string& part : parts_of(judged))
    out.push_back(figures_of(judged, part, [&](const auto&, const auto& p) { return p == part; }));
  return out;
}

Confidence confidence_of(const Judged& judged) {
  Confidence out;
  const auto add = [&](const std::string& group, const std::function<bool(const JudgedAnswer&)>& wanted) {
    if (const Share share = covered(judged, wanted); share.of > 0) out.coverage.push_back({group, share});
  };
  add("all", [](const JudgedAnswer&) { return true; });
  for (const std::string& level : levels_of(judged))
    add("level " + level, [&](const JudgedAnswer& a) { return a.level == level; });
  for (const std::string& part : parts_of(judged)) add(part, [&](const JudgedAnswer& a) { return a.part == part; });
  add("visible < 40 %", [](const JudgedAnswer& a) { return a.visible < 0.4; });
  add("visible 40-70 %", [](const JudgedAnswer& a) { return a.visible >= 0.4 && a.visible < 0.7; });
  add("visible >= 70 %", [](const JudgedAnswer& a) { return a.visible >= 0.7; });

  const std::vector<JudgedAnswer>& answers = judged.answers;
  out.calibration_error = bootstrap(static_cast<int>(answers.size()),
                                    [&](const std::vector<int>& chosen) { return calibration_error(answers, chosen); });
  std::vector<int> all(answers.size());
  std::iota(all.begin(), all.end(), 0);
  out.calibration_floor = calibration_floor(answers, all);
  if (!all.empty())
    for (const std::vector<int>& bin : bins_of(answers, all)) {
      if (bin.empty()) continue;
      double score = 0;
      int good = 0;
      for (const int a : bin) score += answers[a].score, good += right(answers[a]);
      out.bins.push_back({score / static_cast<double>(bin.size()), share_of(good, static_cast<int>(bin.size()))});
    }
  out.score_at_risk = score_at_risk(judged);
  out.given_at_risk = given_above(judged, out.score_at_risk);
  out.given_at_099 = given_above(judged, 0.99);
  int sure = 0, wrong = 0;
  for (const JudgedAnswer& answer : answers)
    sure += answer.score >= 0.99, wrong += answer.score >= 0.99 && !right(answer);
  out.false_at_099 = share_of(wrong, sure);
  return out;
}

}  // namespace tribin::eval
