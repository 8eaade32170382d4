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

std::string table2(const std::vector<PaperRun>& runs) {
  std::string out =
      line("Table II: mean absolute error        X mm    Y mm    Z mm    norm  Xth deg Yth deg Zth deg    norm");
  const std::vector<std::string> parts = parts_of(runs);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    double mm[3], deg[3];
    for (int k = 0; k < 3; ++k) {
      mm[k] = mean(values(runs, parts[i], [k](const PaperRun& r) { return std::abs(r.error.translation_axes_mm[k]); }));
      deg[k] =
          mean(values(runs, parts[i], [k](const PaperRun& r) { return std::abs(r.error.rotation_axes[k]) / kDegree; }));
    }
    out += line("  %-24s tribin %7.4f %7.4f %7.4f %7.4f  %7.4f %7.4f %7.4f %7.4f", parts[i].c_str(), mm[0], mm[1],
                mm[2], mean(values(runs, parts[i], translation)), deg[0], deg[1], deg[2],
                mean(values(runs, parts[i], rotation_deg)));
    if (i < std::size(kTable2)) {
      const PaperErrors& p = kTable2[i];
      out += line("  %-24s paper  %7.2f %7.2f %7.2f %7.2f  %7.2f %7.2f %7.2f %7.2f", p.name, p.mm[0], p.mm[1], p.mm[2],
                  std::hypot(p.mm[0], p.mm[1], p.mm[2]), p.deg[0], p.deg[1], p.deg[2],
                  std::hypot(p.deg[0], p.deg[1], p.deg[2]));
    }
  }
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
  for (const PaperRun& run : runs)
    if (!run.found)
      out += line("  not found: %s, seed %d%s", run.part.c_str(), run.seed,
                  run.class_right ? " (right class, wrong pose)" : "");
  return out;
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
    if (times)
      for (const auto& [stage, ms] : run.times.stages_ms) entry["stages_ms"][stage] = ms;
    out["poses"].push_back(entry);
  }
  return out.dump(2) + "\n";
}

}  // namespace tribin::cli
