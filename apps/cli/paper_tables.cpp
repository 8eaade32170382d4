#include "paper_tables.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace tribin::cli {
namespace {

// Barajas et al., table I (Core 2 Duo E7500) and table II.
struct PaperStage {
  const char *stage, *words;
  double ms;
};
constexpr PaperStage kTable1[] = {{"surface_normals", "surface normals", 5421.80},
                                  {"segmentation", "segmentation", 6926.70},
                                  {"modelling", "modelling", 8458.12},
                                  {"recognition_and_pose", "recognition and pose", 1127.30}};
constexpr double kPaperTotalMs = 21933.92;  // from cloud to pose, without the acquisition of 2431.95 ms
struct PaperErrors {
  const char* name;
  double mm[3], deg[3];
};
constexpr PaperErrors kTable2[] = {{"Alternator A", {15.3, 5.2, 18.7}, {2.10, 0.50, 1.17}},
                                   {"Alternator B", {13.7, 4.75, 16.7}, {1.94, 1.70, 1.42}}};

std::string line(const char* format, ...) {
  char out[256];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(out, sizeof out, format, arguments);
  va_end(arguments);
  return std::string(out) + "\n";
}

std::vector<std::string> parts_of(const std::vector<PaperRun>& runs) {
  std::vector<std::string> out;
  for (const PaperRun& run : runs)
    if (std::find(out.begin(), out.end(), run.part) == out.end()) out.push_back(run.part);
  return out;
}

template <class Value>
std::vector<double> values(const std::vector<PaperRun>& runs, const std::string& part, const Value& value) {
  std::vector<double> out;
  for (const PaperRun& run : runs)
    if (run.found && (part.empty() || run.part == part)) out.push_back(value(run));
  return out;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (double v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

/// Root mean square of error / bound over the runs whose bound is known: 1 is the best that any estimator can do.
double ratio_to_bound(const std::vector<PaperRun>& runs, bool rotation) {
  double sum = 0;
  int count = 0;
  for (const PaperRun& run : runs) {
    const double bound = rotation ? run.bound_rotation : run.bound_translation_mm;
    if (!run.found || bound <= 0) continue;
    const double ratio = (rotation ? run.error.rotation : run.error.translation_mm) / bound;
    sum += ratio * ratio;
    ++count;
  }
  return count ? std::sqrt(sum / count) : 0;
}

double translation(const PaperRun& run) { return run.error.translation_mm; }
double rotation_deg(const PaperRun& run) { return run.error.rotation / kDegree; }

std::string table1(const std::vector<PaperRun>& runs) {
  std::string out = line("Table I: median milliseconds a stage      tribin       paper");
  for (const PaperStage& stage : kTable1) {
    std::vector<double> ms;
    for (const PaperRun& run : runs) ms.push_back(run.times.of(stage.stage));
    out += line("  %-34s %11.1f %11.1f", stage.words, eval::quantile(ms, 0.5), stage.ms);
  }
  std::vector<double> total;
  for (const PaperRun& run : runs) total.push_back(run.times.total());
  return out + line("  %-34s %11.1f %11.1f", "total, cloud to pose", eval::quantile(total, 0.5), kPaperTotalMs);
}

/// Means of the absolute errors along the axes, and of their norms.
struct MeanErrors {
  double mm[4] = {}, deg[4] = {};
  std::size_t count = 0;
};

MeanErrors mean_errors(const std::vector<eval::PoseError>& errors) {
  MeanErrors out;
  out.count = errors.size();
  const auto mean_of = [&](auto value) {
    std::vector<double> all;
    for (const eval::PoseError& e : errors) all.push_back(value(e));
    return mean(all);
  };
  for (int k = 0; k < 3; ++k) {
    out.mm[k] = mean_of([k](const eval::PoseError& e) { return std::abs(e.translation_axes_mm[k]); });
    out.deg[k] = mean_of([k](const eval::PoseError& e) { return std::abs(e.rotation_axes[k]) / kDegree; });
  }
  out.mm[3] = mean_of([](const eval::PoseError& e) { return e.translation_mm; });
  out.deg[3] = mean_of([](const eval::PoseError& e) { return e.rotation / kDegree; });
  return out;
}

std::string error_line(const std::string& words, const MeanErrors& e, int decimals) {
  std::string out = line("  %-40s", words.c_str());
  out.pop_back();
  for (const double* row : {e.mm, e.deg})
    for (int k = 0; k < 4; ++k) {
      char cell[32];
      std::snprintf(cell, sizeof cell, k == 0 ? " %8.*f" : " %7.*f", decimals, row[k]);
      out += cell;
    }
  return out + "\n";
}

std::string table2(const std::vector<PaperRun>& runs) {
  std::string out = line("%-42s %8s %7s %7s %7s %8s %7s %7s %7s", "Table II: mean absolute error", "X mm", "Y mm",
                         "Z mm", "norm", "Xth deg", "Yth deg", "Zth deg", "norm");
  const std::vector<std::string> parts = parts_of(runs);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    std::vector<eval::PoseError> ours, answered, near;
    bool asked = false;
    for (const PaperRun& run : runs) {
      if (run.part != parts[i]) continue;
      if (run.found) ours.push_back(run.error);
      if (!run.paper) continue;
      asked = true;
      if (run.paper->class_right) answered.push_back(run.paper->error);
      if (run.paper->found) near.push_back(run.paper->error);
    }
    if (i < std::size(kTable2)) {
      const PaperErrors& p = kTable2[i];
      MeanErrors printed{{p.mm[0], p.mm[1], p.mm[2], std::hypot(p.mm[0], p.mm[1], p.mm[2])},
                         {p.deg[0], p.deg[1], p.deg[2], std::hypot(p.deg[0], p.deg[1], p.deg[2])}};
      out += error_line(p.name + std::string(", the paper's figures"), printed, 2);
    }
    if (asked) {
      out += error_line(parts[i] + ", its method, found " + std::to_string(near.size()), mean_errors(near), 2);
      out += error_line(parts[i] + ", its method, right class " + std::to_string(answered.size()),
                        mean_errors(answered), 2);
    }
    out += error_line(parts[i] + ", tribin, found " + std::to_string(ours.size()), mean_errors(ours), 4);
  }
  return out;
}

/// How far the paper's method came, and where it stopped.
std::string paper_method_summary(const std::vector<PaperRun>& runs) {
  int count = 0, answered = 0, right = 0, found = 0;
  std::vector<double> ms, mm, deg;
  std::vector<std::pair<std::string, int>> refused;
  for (const PaperRun& run : runs) {
    if (!run.paper) continue;
    ++count, answered += run.paper->answered, right += run.paper->class_right, found += run.paper->found;
    ms.push_back(run.paper->ms);
    if (run.paper->class_right)
      mm.push_back(run.paper->error.translation_mm), deg.push_back(run.paper->error.rotation / kDegree);
    if (run.paper->answered) continue;
    const auto known = std::find_if(refused.begin(), refused.end(),
                                    [&](const auto& entry) { return entry.first == run.paper->refused_by; });
    if (known == refused.end())
      refused.emplace_back(run.paper->refused_by, 1);
    else
      ++known->second;
  }
  if (count == 0) return {};
  const eval::Share share = eval::share_of(right, count);
  std::string out =
      line("the paper's method: answered %d of %d, class right %d (95 %% interval %.3f to %.3f), found %d", answered,
           count, right, share.low, share.high, found);
  out += line("  right class: translation median %.2f mm, 95 %% %.2f mm; rotation median %.2f deg, 95 %% %.2f deg",
              eval::quantile(mm, 0.5), eval::quantile(mm, 0.95), eval::quantile(deg, 0.5), eval::quantile(deg, 0.95));
  out += line("  recognition and pose: median %.0f ms", eval::quantile(ms, 0.5));
  for (const auto& [test, times] : refused)
    out += line("  no answer in %d: %s", times,
                test.empty() ? "no cylinder is seen" : ("the furthest candidates fell to " + test).c_str());
  return out;
}

}  // namespace

std::string paper_tables(const std::vector<PaperRun>& runs) {
  int right = 0, found = 0, false_answers = 0;
  for (const PaperRun& run : runs) right += run.class_right, found += run.found, false_answers += run.false_answers;
  const int count = static_cast<int>(runs.size());
  const eval::Share share = eval::share_of(right, count);
  const auto mm = values(runs, "", translation), deg = values(runs, "", rotation_deg);
  std::string out = table1(runs) + "\n" + table2(runs) + "\n";
  out += line("class right %d of %d (95 %% interval %.3f to %.3f), found %d, false answers %d", right, count, share.low,
              share.high, found, false_answers);
  out += line("translation median %.4f mm, 95 %% %.4f mm; rotation median %.4f deg, 95 %% %.4f deg (over %zu found)",
              eval::quantile(mm, 0.5), eval::quantile(mm, 0.95), eval::quantile(deg, 0.5), eval::quantile(deg, 0.95),
              mm.size());
  if (ratio_to_bound(runs, false) > 0)
    out += line("rms ratio to the Cramer-Rao bound of the very pixels: translation %.2f, rotation %.2f",
                ratio_to_bound(runs, false), ratio_to_bound(runs, true));
  out += paper_method_summary(runs);
  for (const PaperRun& run : runs)
    if (!run.found)
      out += line("  not found: %s, seed %d%s", run.part.c_str(), run.seed,
                  run.class_right ? " (right class, wrong pose)" : "");
  return out;
}

std::string paper_method_words(const PaperRun& run) {
  if (!run.paper) return {};
  if (!run.paper->answered) return "; paper: none, " + run.paper->refused_by;
  if (!run.paper->class_right) return "; paper: wrong class";
  std::string words = line("; paper: %.2f mm, %.2f deg%s", run.paper->error.translation_mm,
                           run.paper->error.rotation / kDegree, run.paper->found ? "" : ", not found");
  words.pop_back();
  return words;
}

std::string paper_json(const std::vector<PaperRun>& runs, bool times) {
  using Json = nlohmann::ordered_json;
  const auto mm = values(runs, "", translation), deg = values(runs, "", rotation_deg);
  int right = 0, found = 0, false_answers = 0;
  for (const PaperRun& run : runs) right += run.class_right, found += run.found, false_answers += run.false_answers;
  Json out = {
      {"tribin", TRIBIN_VERSION},
      {"schema", 1},
      {"experiment", "paper"},
      {"runs", runs.size()},
      {"class_right", right},
      {"found", found},
      {"false_answers", false_answers},
      {"translation_mm", {{"median", eval::quantile(mm, 0.5)}, {"q95", eval::quantile(mm, 0.95)}}},
      {"rotation_deg", {{"median", eval::quantile(deg, 0.5)}, {"q95", eval::quantile(deg, 0.95)}}},
      {"ratio_to_bound", {{"translation", ratio_to_bound(runs, false)}, {"rotation", ratio_to_bound(runs, true)}}}};
  out["poses"] = Json::array();
  for (const PaperRun& run : runs) {
    Json entry = {{"part", run.part}, {"seed", run.seed}, {"class_right", run.class_right}, {"found", run.found}};
    if (run.found) {
      const Vec3 t = run.error.translation_axes_mm, w = run.error.rotation_axes / kDegree;
      entry["translation_error_mm"] = {t.x(), t.y(), t.z()};
      entry["rotation_error_deg"] = {w.x(), w.y(), w.z()};
      entry["bound_mm"] = run.bound_translation_mm;
      entry["bound_deg"] = run.bound_rotation / kDegree;
    }
    if (run.paper) {
      Json& paper = entry["paper_method"];
      paper = {{"answered", run.paper->answered}, {"class_right", run.paper->class_right}, {"found", run.paper->found}};
      if (run.paper->class_right) {
        const Vec3 t = run.paper->error.translation_axes_mm, w = run.paper->error.rotation_axes / kDegree;
        paper["translation_error_mm"] = {t.x(), t.y(), t.z()};
        paper["rotation_error_deg"] = {w.x(), w.y(), w.z()};
      }
      if (!run.paper->answered) paper["refused_by"] = run.paper->refused_by;
      if (times) paper["recognition_and_pose_ms"] = run.paper->ms;
    }
    if (times)
      for (const auto& [stage, ms] : run.times.stages_ms) entry["stages_ms"][stage] = ms;
    out["poses"].push_back(entry);
  }
  return out.dump(2) + "\n";
}

}  // namespace tribin::cli
