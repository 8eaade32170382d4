#include "tribin/report/eval_report.hpp"

#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "report/json_values.hpp"

namespace tribin {
namespace {

using eval::Confidence;
using eval::Estimate;
using eval::Figures;
using eval::Judged;
using eval::JudgedAnswer;
using eval::JudgedTruth;
using eval::Share;
using json::Json;

std::string line(const char* format, ...) {
  char text[400];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return std::string(text) + "\n";
}

/// "47/50 94.0 % (83.8-97.9)"
std::string words(const Share& share) {
  if (share.of == 0) return "-";
  char text[80];
  std::snprintf(text, sizeof text, "%d/%d %.1f %% (%.1f-%.1f)", share.count, share.of, 100.0 * share.count / share.of,
                100 * share.low, 100 * share.high);
  return text;
}

/// "0.046 (0.041-0.052)"; an open end is left open.
std::string words(const Estimate& estimate, int decimals) {
  if (estimate.count == 0) return "-";
  char text[80];
  if (std::isfinite(estimate.high))
    std::snprintf(text, sizeof text, "%.*f (%.*f-%.*f)", decimals, estimate.value, decimals, estimate.low, decimals,
                  estimate.high);
  else
    std::snprintf(text, sizeof text, "%.*f (%.*f-)", decimals, estimate.value, decimals, estimate.low);
  return text;
}

std::string tables(const std::vector<Figures>& groups) {
  std::string out =
      line("%-22s %-28s %-28s %-28s", "", "found of >= 40 % visible", "found of >= 70 % visible", "false of given out");
  for (const Figures& f : groups)
    out += line("%-22s %-28s %-28s %-28s", f.name.c_str(), words(f.recall_40).c_str(), words(f.recall_70).c_str(),
                words(f.false_share).c_str());
  out += line("\n%-22s %5s  %-24s %-24s %-24s %-24s", "errors of the found", "", "median mm", "95 % mm", "median deg",
              "95 % deg");
  for (const Figures& f : groups)
    out += line("%-22s %5d  %-24s %-24s %-24s %-24s", f.name.c_str(), f.median_mm.count, words(f.median_mm, 4).c_str(),
                words(f.high_mm, 4).c_str(), words(f.median_deg, 4).c_str(), words(f.high_deg, 4).c_str());
  if (groups.front().bound_ratio_mm.count > 0) {
    out += line("\n%-22s %5s  %-24s %-24s %-24s %-24s", "error / Cramer-Rao", "", "median, place", "rms, place",
                "median, rotation", "rms, rotation");
    for (const Figures& f : groups)
      out += line("%-22s %5d  %-24s %-24s %-24s %-24s", f.name.c_str(), f.bound_ratio_mm.count,
                  words(f.bound_ratio_mm, 2).c_str(), words(f.bound_rms_mm, 2).c_str(),
                  words(f.bound_ratio_deg, 2).c_str(), words(f.bound_rms_deg, 2).c_str());
  }
  out += line("\n%-22s %5s %9s %5s %11s %11s %7s  %-26s %-26s %s", "false answers", "flip", "duplicate", "class",
              "place", "nothing", "told", "flips of given out", "right but undecided", "listed as uncertain");
  for (const Figures& f : groups)
    out += line("%-22s %5d %9d %5d %11d %11d %7d  %-26s %-26s %s", f.name.c_str(), f.verdicts[3], f.verdicts[2],
                f.verdicts[4], f.verdicts[5], f.verdicts[6], f.told, words(f.flips).c_str(), words(f.undecided).c_str(),
                words(f.withheld).c_str());
  return out;
}

std::string in_view_text(const std::vector<Figures>& groups) {
  std::string out =
      line("\n%-22s %-28s %-28s", "telling feature in view", "found of >= 40 % visible", "listed as uncertain");
  for (const Figures& f : groups)
    out += line("%-22s %-28s %-28s", f.name.c_str(), words(f.recall_told).c_str(), words(f.withheld_told).c_str());
  return out;
}

std::string confidence_text(const Confidence& c, bool uncertainty) {
  std::string out;
  if (uncertainty) {
    out += line("\nerrors in their 95 %% ellipsoids");
    for (const Confidence::Coverage& coverage : c.coverage)
      out += line("%-22s %s", coverage.group.c_str(), words(coverage.inside).c_str());
  }
  out += line("\nscore: expected calibration error %s in ten bins of %d answers (a perfect score: %.4f)",
              words(c.calibration_error, 4).c_str(), c.calibration_error.count, c.calibration_floor);
  for (const Confidence::Bin& bin : c.bins) out += line("  score %.3f: right %s", bin.score, words(bin.right).c_str());
  out += line("at 1 %% accepted risk (score >= %.3f): found %s of >= 40 %% visible", c.score_at_risk,
              words(c.given_at_risk).c_str());
  out += line("with score >= 0.99: found %s of >= 40 %% visible, false %s", words(c.given_at_099).c_str(),
              words(c.false_at_099).c_str());
  return out;
}

std::string list_text(const Judged& judged) {
  std::string out = line("\nmissed parts that show >= 40 %%:");
  for (const JudgedTruth& t : judged.truths)
    if (t.answer < 0 && t.visible >= 0.4)
      out += line("  scene %d image %d %s %s, visible %.2f, at (%.1f, %.1f, %.1f)%s%s%s%s", t.scene, t.image,
                  t.level.c_str(), t.part.c_str(), t.visible, t.at_mm.x(), t.at_mm.y(), t.at_mm.z(),
                  t.withheld ? ", listed as uncertain" : "", t.in_view ? "" : ", its telling feature is hidden",
                  t.reason.empty() ? "" : ": ", t.reason.c_str());
  out += line("false answers:");
  for (const JudgedAnswer& a : judged.answers)
    if (eval::is_false(a.verdict))
      out += line("  scene %d image %d %s %s, score %.3f, %s%s%s%s, nearest part shows %.2f, at (%.1f, %.1f, %.1f)",
                  a.scene, a.image, a.level.c_str(), a.part.c_str(), a.score, eval::name_of(a.verdict),
                  a.confused_with.empty() ? "" : ": it is ", a.confused_with.c_str(),
                  a.told               ? ", an alternative is right"
                  : a.alternatives > 0 ? ", undecided"
                                       : "",
                  a.visible, a.at_mm.x(), a.at_mm.y(), a.at_mm.z());
  return out;
}

Json share_json(const Share& s) {
  return {{"count", s.count},
          {"of", s.of},
          {"share", s.of > 0 ? json::rounded(static_cast<double>(s.count) / s.of, 5) : Json()},
          {"low", json::rounded(s.low, 5)},
          {"high", json::rounded(s.high, 5)}};
}

Json estimate_json(const Estimate& e) {
  return {{"value", e.count > 0 ? json::significant(e.value) : Json()},
          {"low", json::significant(e.low)},
          {"high", json::significant(e.high)},  // null: open
          {"count", e.count}};
}

Json figures_json(const Figures& f) {
  Json verdicts;
  for (int v = 0; v < 7; ++v) verdicts[eval::name_of(static_cast<eval::Verdict>(v))] = f.verdicts[v];
  return {{"group", f.name},
          {"recall_40", share_json(f.recall_40)},
          {"recall_70", share_json(f.recall_70)},
          {"false", share_json(f.false_share)},
          {"answers", verdicts},
          {"flips", share_json(f.flips)},
          {"confusions", share_json(f.confusions)},
          {"undecided", share_json(f.undecided)},
          {"withheld", share_json(f.withheld)},
          {"recall_in_view", share_json(f.recall_told)},
          {"withheld_in_view", share_json(f.withheld_told)},
          {"told", f.told},
          {"translation_mm", {{"median", estimate_json(f.median_mm)}, {"quantile_95", estimate_json(f.high_mm)}}},
          {"rotation_deg", {{"median", estimate_json(f.median_deg)}, {"quantile_95", estimate_json(f.high_deg)}}},
          {"ratio_to_bound",
           {{"translation_median", estimate_json(f.bound_ratio_mm)},
            {"translation_rms", estimate_json(f.bound_rms_mm)},
            {"rotation_median", estimate_json(f.bound_ratio_deg)},
            {"rotation_rms", estimate_json(f.bound_rms_deg)}}}};
}

Json confidence_json(const Confidence& c) {
  Json out = {{"coverage_95", Json::array()},
              {"calibration_error", estimate_json(c.calibration_error)},
              {"calibration_error_by_chance", json::significant(c.calibration_floor)},
              {"bins", Json::array()}};
  for (const Confidence::Coverage& coverage : c.coverage)
    out["coverage_95"].push_back({{"group", coverage.group}, {"inside", share_json(coverage.inside)}});
  for (const Confidence::Bin& bin : c.bins)
    out["bins"].push_back({{"score", json::rounded(bin.score, 4)}, {"right", share_json(bin.right)}});
  out["given_at_1_percent_risk"] = share_json(c.given_at_risk);
  out["score_at_1_percent_risk"] = json::rounded(c.score_at_risk, 4);
  out["given_with_score_099"] = share_json(c.given_at_099);
  out["false_with_score_099"] = share_json(c.false_at_099);
  return out;
}

}  // namespace

std::string eval_text(const Judged& judged, bool list) {
  std::string out =
      line("%d images, %zu parts, %zu answers", judged.images, judged.truths.size(), judged.answers.size());
  if (judged.images_without_result > 0)
    out += line("%d images have no result: their parts count as missed", judged.images_without_result);
  if (judged.images_without_parts > 0)
    out += line("%d answers in %d images without any part", judged.given_without_parts, judged.images_without_parts);
  if (!judged.seconds.empty())
    out += line("seconds an image: median %s, 95 %% %s", words(eval::quantile_estimate(judged.seconds, 0.5), 2).c_str(),
                words(eval::quantile_estimate(judged.seconds, 0.95), 2).c_str());
  const std::vector<Figures> groups = eval::all_figures(judged);
  out += "\n" + tables(groups);
  if (judged.in_view_known) out += in_view_text(groups);
  if (!judged.answers.empty()) out += confidence_text(eval::confidence_of(judged), judged.uncertainty);
  if (list) out += list_text(judged);
  return out;
}

std::string eval_json(const Judged& judged) {
  Json out = json::head();
  out["images"] = judged.images;
  out["images_without_result"] = judged.images_without_result;
  out["images_without_parts"] = judged.images_without_parts;
  out["given_without_parts"] = judged.given_without_parts;
  out["seconds"] = {{"median", estimate_json(eval::quantile_estimate(judged.seconds, 0.5))},
                    {"quantile_95", estimate_json(eval::quantile_estimate(judged.seconds, 0.95))}};
  out["in_view_known"] = judged.in_view_known;
  out["groups"] = Json::array();
  for (const Figures& figures : eval::all_figures(judged)) out["groups"].push_back(figures_json(figures));
  out["confidence"] = confidence_json(eval::confidence_of(judged));
  out["missed"] = Json::array();
  for (const JudgedTruth& t : judged.truths)
    if (t.answer < 0 && t.visible >= 0.4)
      out["missed"].push_back({{"scene_id", t.scene},
                               {"im_id", t.image},
                               {"part", t.part},
                               {"visible_fraction", json::rounded(t.visible, 4)},
                               {"at_mm", json::millimetres(t.at_mm)},
                               {"uncertain", t.withheld},
                               {"in_view", t.in_view},
                               {"reason", t.reason}});
  out["false_answers"] = Json::array();
  for (const JudgedAnswer& a : judged.answers)
    if (eval::is_false(a.verdict))
      out["false_answers"].push_back({{"scene_id", a.scene},
                                      {"im_id", a.image},
                                      {"part", a.part},
                                      {"score", json::rounded(a.score, 4)},
                                      {"verdict", eval::name_of(a.verdict)},
                                      {"confused_with", a.confused_with},
                                      {"alternative_is_right", a.told},
                                      {"at_mm", json::millimetres(a.at_mm)}});
  return json::text_of(out);
}

}  // namespace tribin
