#include "report/sections.hpp"

#include <algorithm>
#include <cmath>

#include "report/html.hpp"
#include "report/json_values.hpp"
#include "report/links.hpp"
#include "tribin/report/summary.hpp"

namespace tribin::report {

int class_of(std::span<const Part> parts, const std::string& name) {
  for (std::size_t i = 0; i < parts.size(); ++i)
    if (parts[i].name == name) return static_cast<int>(i);
  return -1;
}

namespace {

std::string named(std::span<const Part> parts, const std::string& name) {
  return "<span class=\"name\">" + class_tag(std::max(0, class_of(parts, name))) + escaped(name) + "</span>";
}

std::string head(const std::vector<std::string>& columns, std::size_t text_columns) {
  std::string out = "<div class=\"box\"><table><thead><tr>";
  for (std::size_t i = 0; i < columns.size(); ++i)
    out += (i < text_columns ? "<th>" : "<th class=\"num\">") + columns[i] + "</th>";
  return out + "</tr></thead><tbody>";
}
const char* const kTail = "</tbody></table></div>\n";

/// What a pose leaves open, in words; empty when nothing.
std::string open_directions(const Instance& instance) {
  std::string out;
  if (!instance.free_directions.empty())
    out += "Free by symmetry: " + std::to_string(instance.free_directions.size()) + " direction" +
           (instance.free_directions.size() == 1 ? "" : "s") + ". ";
  for (const WeakDirection& weak : instance.weak_directions)
    out += "Weak: σ " + number(weak.sigma_mm, 2) + " mm, " + number(weak.sigma / kDegree, 2) + "°. " +
           escaped(weak.cure) + ". ";
  for (const Alternative& other : instance.alternatives)
    out += "Undecided: another pose with probability " + number(other.probability, 2) + ", decided by " +
           escaped(other.decided_by) + ". ";
  return out;
}

}  // namespace

std::string warning_lines(const std::vector<Warning>& warnings, const std::vector<std::string>& more) {
  std::string out;
  for (const auto& entry : json::warnings(warnings, more))
    out += "<div class=\"warning\" role=\"note\">" + state_icon("warn") + "<span>" +
           escaped(entry["text"].get<std::string>()) + "</span></div>\n";
  return out;
}

std::string poses_section(const Scan& scan, std::span<const Part> parts, const Found& found,
                          const std::optional<ReportTruth>& truth) {
  std::string out =
      section("poses", "Poses",
              "camera_from_part: where each part's CAD origin lies in the input's frame. Rx Ry Rz as Yaskawa counts "
              "them: R = Rz Ry Rx. σ is one standard deviation along the worst axis, at the centre of the part's "
              "box, noise and systematic terms together." +
                  std::string(truth ? " The last two columns compare with the simulated truth." : ""));
  if (found.instances.items.empty()) return out + "<p>No part is given out.</p></section>\n";
  std::vector<std::string> columns = {"Part",
                                      "Score",
                                      "Visible",
                                      "x" + unit("mm"),
                                      "y" + unit("mm"),
                                      "z" + unit("mm"),
                                      "Rx" + unit("deg"),
                                      "Ry" + unit("deg"),
                                      "Rz" + unit("deg"),
                                      "σ" + unit("mm"),
                                      "σ" + unit("deg")};
  std::optional<eval::Judgement> judged;
  if (truth) {
    columns.insert(columns.end(), {"Error" + unit("mm"), "Error" + unit("deg")});
    judged = eval::judge(found.instances.items, truth->truths, truth->models);
  }
  out += head(columns, 1);
  for (std::size_t i = 0; i < found.instances.items.size(); ++i) {
    const Instance& instance = found.instances.items[i];
    const int part = class_of(parts, instance.part);
    const Pose pose = scan.input_from_camera * instance.camera_from_part;
    const Vec3 t = pose.translation(), r = yaskawa_angles(Matrix3(pose.linear())) / kDegree;
    const PoseSigma sigma = pose_sigma(instance, part < 0 ? Vec3(Vec3::Zero()) : parts[part].box_center());
    out += "<tr><td>" + named(parts, instance.part) + "</td>" + cell(number(instance.score, 3)) +
           cell(number(100 * instance.visible_fraction, 0) + unit("%"));
    for (int k = 0; k < 3; ++k) out += cell(number(t[k], 3));
    for (int k = 0; k < 3; ++k) out += cell(number(r[k], 3));
    out += cell(number(sigma.translation_mm, 3)) + cell(number(sigma.rotation / kDegree, 4));
    if (judged) {
      const auto match = std::find_if(judged->found.begin(), judged->found.end(),
                                      [&](const eval::Match& m) { return m.answer == static_cast<int>(i); });
      if (match == judged->found.end())
        out += "<td class=\"num bad-text\">false</td><td></td>";
      else
        out += cell(number(match->error.translation_mm, 3)) + cell(number(match->error.rotation / kDegree, 4));
    }
    out += "</tr>";
    const std::string open = open_directions(instance);
    if (!open.empty())
      out += "<tr><td class=\"wrap muted\" colspan=\"" + std::to_string(columns.size()) + "\">" + open + "</td></tr>";
  }
  out += kTail;
  if (judged && !judged->missed.empty())
    out += "<p class=\"bad-text\">" + std::to_string(judged->missed.size()) + " of " + std::to_string(judged->asked) +
           " parts that are really there were not found.</p>";
  return out + "</section>\n";
}

namespace {

int digits_of(const TestResult& test) {
  const double size = std::max(std::abs(test.value), std::abs(test.limit));
  return size >= 100 ? 0 : size >= 1 ? 2 : 3;
}

/// What differs from its nominal value by more than 3 sigma: how many, and the worst.
struct Beyond {
  int count = 0, of = 0;
  double sigmas = 0;
  std::string primitive;
  double by_mm = 0;
  bool radius = false;
};

std::string evidence_row(const Evidence& e, int part_class, Beyond& beyond) {
  const std::string key = e.scan_primitive > 0 ? scan_key(e.scan_primitive) : cad_key(part_class, e.cad_primitive);
  std::string out = "<tr" + link_to({key}) + "><td>" + type_icon(e.type) + " " + escaped(e.primitive) +
                    (e.radius_nominal_mm ? ", r" : ", place") + "</td>";
  std::optional<double> nominal = e.radius_nominal_mm, measured = e.radius_measured_mm, sigma = e.radius_sigma_mm;
  if (!nominal && e.offset_mm) nominal = 0, measured = e.offset_mm, sigma = e.offset_sigma_mm;
  if (nominal && measured && sigma && *sigma > 0) {
    const int decimals = std::max(2, decimals_for(*sigma));
    const double off = (*measured - *nominal) / *sigma;
    ++beyond.of;
    if (std::abs(off) > 3) ++beyond.count;
    if (std::abs(off) > 3 && std::abs(off) > std::abs(beyond.sigmas))
      beyond = {
          beyond.count, beyond.of, off, e.primitive, *measured - *nominal, static_cast<bool>(e.radius_nominal_mm)};
    out += cell(number(*nominal, 2)) + cell(number(*measured, decimals)) + cell(number(*sigma, decimals + 1)) + "<td>" +
           sigma_rail(off) + "</td>";
  } else {
    out += cell(nominal ? number(*nominal, 2) : "–") + cell(measured ? number(*measured, 2) : "–") + cell("–") +
           "<td class=\"muted\">" + (nominal ? "held at CAD" : "") + "</td>";
  }
  out += cell(e.visible_arc > 0 ? number(e.visible_arc / kDegree, 0) + "°" : "–") + cell(number(e.rms_mm, 3)) + "</tr>";
  if (e.tests.empty()) return out;
  out += "<tr><td class=\"wrap muted\" colspan=\"7\">";
  for (const TestResult& test : e.tests) {
    std::string words = test.test;
    std::replace(words.begin(), words.end(), '_', ' ');
    out += "<span class=\"test\">" + escaped(words) + " <b>" + number(test.value, digits_of(test)) + "</b> " +
           (test.at_least ? "≥ " : "≤ ") + number(test.limit, digits_of(test)) + "</span>";
  }
  return out + "</td></tr>";
}

/// The decision on a part's quality with its reasons; the dimensions stand in the JSON.
std::string quality_lines(const Quality& quality) {
  std::string decision = name_of(quality.decision);
  std::replace(decision.begin(), decision.end(), '_', ' ');
  const bool bad = quality.decision == QualityDecision::deviates;
  std::string out = std::string("<p") + (bad ? " class=\"bad-text\"" : "") + ">Quality: <b>" + decision + "</b>, " +
                    std::to_string(quality.dimensions.size()) + " dimensions and " +
                    number(100 * quality.checked_fraction, 0) + " % of the silhouette compared.</p>";
  if (quality.reasons.empty()) return out;
  constexpr std::size_t kMost = 6;  // one fault moves many dimensions; the JSON has them all
  out += "<ul>";
  for (std::size_t i = 0; i < quality.reasons.size() && i < kMost; ++i)
    out += "<li>" + escaped(quality.reasons[i]) + "</li>";
  if (quality.reasons.size() > kMost) out += "<li>and " + std::to_string(quality.reasons.size() - kMost) + " more</li>";
  return out + "</ul>";
}

}  // namespace

std::string evidence_section(std::span<const Part> parts, const Found& found) {
  std::string out =
      section("evidence", "Evidence",
              "Every primitive that was matched, measured without its nominal value; planes by their place along "
              "the normal. Ticks mark 3 σ.");
  constexpr std::size_t kOpen = 10, kMost = 12;  // a page, not a data base: the JSON has them all
  std::string tables;
  Beyond beyond;
  for (std::size_t i = 0; i < found.instances.items.size() && i < kMost; ++i) {
    const Instance& instance = found.instances.items[i];
    const int part_class = std::max(0, class_of(parts, instance.part));
    tables +=
        "<div><h3>" + class_tag(part_class) + escaped(instance.part) + " " + std::to_string(instance.id) + "</h3>";
    tables += quality_lines(instance.quality);
    const std::vector<std::string> columns = {
        "Primitive" + unit("mm"), "Nominal", "Measured", "σ", "Difference", "Arc", "rms"};
    tables += head(columns, 1);
    for (std::size_t k = 0; k < instance.evidence.size(); ++k) {
      // The largest few are the proof; the rest is there for who asks.
      if (k == kOpen && instance.evidence.size() > kOpen + 2)
        tables += std::string(kTail) + "<details><summary>" + std::to_string(instance.evidence.size() - kOpen) +
                  " smaller ones</summary>" + head(columns, 1);
      tables += evidence_row(instance.evidence[k], part_class, beyond);
    }
    tables += std::string(kTail) + (instance.evidence.size() > kOpen + 2 ? "</details>" : "") + "</div>";
  }
  if (found.instances.items.empty()) tables = "<p>There is none: no part is given out.</p>";
  if (beyond.count > 0)
    out += "<p>" + std::to_string(beyond.count) + " of " + std::to_string(beyond.of) +
           " differ from the CAD by more than 3 σ; most of all " + escaped(beyond.primitive) + ", " +
           number(std::abs(beyond.by_mm), 3) + " mm " +
           (beyond.radius ? (beyond.by_mm > 0 ? "larger in radius" : "smaller in radius") : "off its place") + " (" +
           number(std::abs(beyond.sigmas), 1) + " σ).</p>";
  else if (beyond.of > 0)
    out += "<p>All " + std::to_string(beyond.of) + " agree with the CAD within 3 σ.</p>";
  if (found.instances.items.size() > kMost)
    out += "<p>The best " + std::to_string(kMost) + " instances; report.json has all.</p>";
  return out + "<div class=\"two\">" + tables + "</div></section>\n";
}

namespace {

/// The sentence of a test, by its stable key.
std::string sentence_of(const Reason& r) {
  static const std::pair<const char*, const char*> kSentences[] = {
      {"look_up", "Too few of its points would lie on the scan"},
      {"probability", "It would be wrong more often than a robot may be"},
      {"free_space", "It would stand where the camera sees through"},
      {"support", "Too little of its surface is in the scan"},
      {"contour", "Its outline does not meet the scan's depth edges"},
      {"residual", "The scan does not lie on its surface"},
      {"radius_mm", "A radius does not fit"},
      {"log_odds", "Another part explains the same points better"},
      {"overlap", "Another instance explains the same points"},
      {"pixels", "Too few pixels would hold it"},
      {"visible_fraction", "Too little of it would be visible"},
      {"measured_fraction", "Too little of it is measured"},
      {"own_surface", "Most of what would hold it belongs to a wall, a floor or a rim"},
      {"self_similar", "It stands there, but its turn is not settled"},
      {"weak_direction", "It stands there, but a direction of its pose is not held"},
      {"tolerance", "Its place is not sure enough for the tolerance asked for"},
      {"cylinder_radius", "A cylinder's radius is another one's"},
      {"cylinder_height", "A cylinder's height is another one's"},
      {"superquadric", "The points do not lie on the ideal cylinder"},
      {"largest_cylinder", "It is not the part's largest cylinder"},
      {"sub_cylinder", "The two cylinders are too far apart"},
      {"cylinder_angle", "The two axes are not at the part's angle"},
      {"cylinder_distance", "The two axes are not at the part's distance"},
      {"plane_on_cylinder", "No plane meets the key cylinders"},
      {"plane_to_cylinder", "A plane is not at the part's angle to the axis"},
      {"plane_plane_angle", "Two planes are not at the part's angle"},
      {"area_similarity", "A plane is too large or too small beside its cylinder"},
      {"intersected_planes", "More planes meet the key cylinders than the part has"},
      {"shared_planes", "More planes are shared by the key cylinders than the part has"},
      {"icp_distance", "The model's points are too far from the scan's"},
      {"visible", "Too little of it would be visible"},
  };
  for (const auto& [test, sentence] : kSentences)
    if (r.test == test) return sentence;
  std::string words = r.test;
  std::replace(words.begin(), words.end(), '_', ' ');
  return "Fell to the test of " + words;
}

}  // namespace

std::string why_not_section(std::span<const Part> parts, const Found& found) {
  int total = 0;
  for (const Reason& r : found.instances.rejected) total += r.count;
  if (total == 0) return section("why", "Why not?", "No other candidate was refused.") + "</section>\n";
  std::string out = section("why", "Why not?",
                            grouped(total) + (total == 1 ? " other candidate was" : " other candidates were") +
                                " tried and refused. The nearest miss of each reason:");
  out += head({"Candidate", "Reason", "Value", "Limit", "How often"}, 2);
  std::vector<Reason> sorted = found.instances.rejected;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Reason& a, const Reason& b) { return a.count > b.count; });
  for (const Reason& r : sorted) {
    const double size = std::max(std::abs(r.value), std::abs(r.limit));
    const int decimals = size >= 100 ? 0 : size >= 1 ? 2 : 3;
    out += "<tr><td>" + named(parts, r.part) +
           (r.nearest_instance > 0 ? " <span class=\"muted\">beside " + std::to_string(r.nearest_instance) + "</span>"
                                   : "") +
           "</td><td class=\"wrap\">" + sentence_of(r) + " <span class=\"muted\">" + escaped(r.stage + ", " + r.test) +
           "</span></td>" + cell(number(r.value, decimals)) + cell(number(r.limit, decimals)) + cell(grouped(r.count)) +
           "</tr>";
  }
  return out + kTail + "</section>\n";
}

std::string time_section(const StageTimes& times, int threads) {
  struct Row {
    const char *stage, *words;
    double paper_ms;
  };
  // The paper's table I, on a Core 2 Duo E7500; its total from the cloud to the pose leaves out the acquisition.
  static const Row kRows[] = {{"surface_normals", "surface normals", 5421.80},
                              {"segmentation", "segmentation", 6926.70},
                              {"modelling", "modelling", 8458.12},
                              {"recognition_and_pose", "recognition and pose", 1127.30}};
  const auto bar = [](double ms) {
    return number(std::clamp((std::log10(std::max(ms, 0.1)) + 1) / 6 * 100, 0.0, 100.0), 1) + "%";
  };
  const auto row = [&](const std::string& words, double ours, double paper) {
    return "<span>" + words +
           "</span><span class=\"tr\"><i class=\"paper\" style=\"width:" + (paper > 0 ? bar(paper) : "0") +
           "\"></i><i class=\"ours\" style=\"width:" + bar(ours) + "\"></i></span><span class=\"num\">" +
           (ours >= 100 ? grouped(std::llround(ours)) : number(ours, 1)) + unit("ms") +
           "</span><span class=\"num t2\">" + (paper > 0 ? grouped(std::llround(paper)) + unit("ms") : "–") + "</span>";
  };
  std::string out = section(
      "time", "Time",
      "Milliseconds a stage on " + (threads > 0 ? std::to_string(threads) : std::string("all")) +
          (threads == 1 ? " thread" : " threads") +
          ", bars on a logarithmic scale from 0.1 ms to 100 s. Grey: the paper's table I, on a Core 2 Duo E7500.");
  out +=
      "<div class=\"box\"><div class=\"lg\"><span></span><span></span><span class=\"hd\">tribin</span><span "
      "class=\"hd\">paper</span>";
  for (const auto& [stage, ms] : times.stages_ms) {
    const auto known =
        std::find_if(std::begin(kRows), std::end(kRows), [&, s = stage](const Row& r) { return s == r.stage; });
    std::string words = stage;
    std::replace(words.begin(), words.end(), '_', ' ');
    out += known == std::end(kRows) ? row(words, ms, 0) : row(known->words, ms, known->paper_ms);
  }
  return out + row("<b>total, cloud to poses</b>", times.total(), 21933.92) + "</div></div></section>\n";
}

std::string again_section(const ReportContext& context) {
  std::string command;
  for (const std::string& word : context.command) {
    const bool plain = !word.empty() && word.find_first_not_of(
                                            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./,:") ==
                                            std::string::npos;
    std::string quoted = word;
    if (!plain) {
      quoted = "'";
      for (char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
      quoted += "'";
    }
    command += (command.empty() ? "" : " ") + quoted;
  }
  std::string out = section("again", "Run it again", "") + "<pre>" + escaped(command) +
                    "</pre><p style=\"margin-top:8px\">tribin " + std::string(TRIBIN_VERSION) +
                    ", schema 1. SHA-256 of the inputs: ";
  for (std::size_t i = 0; i < context.files.size(); ++i)
    out += (i ? ", " : "") + escaped(context.files[i].filename().string()) + " <code>" +
           sha256_of_file(context.files[i].string()).substr(0, 16) + "…</code>";
  return out + ". The same input gives the same answer, whatever the number of threads.</p></section>\n";
}

std::string primitives_section(const std::vector<Primitive>& primitives, const Pose& b_from_a, const std::string& lead,
                               std::string (*key_of)(int id)) {
  std::string out = section("primitives", "Primitives", lead) +
                    head({"Id", "Type", "Area" + unit("mm²"), "Radius" + unit("mm"), "Height" + unit("mm"),
                          "Arc" + unit("deg"), "Axis or normal", "rms" + unit("mm"), "Points"},
                         2);
  for (const Primitive& p : primitives) {
    const Vec3 axis = b_from_a.linear() * p.axis;
    const bool round =
        p.type == PrimitiveType::cylinder || p.type == PrimitiveType::sphere || p.type == PrimitiveType::torus;
    const bool high = p.type == PrimitiveType::cylinder || p.type == PrimitiveType::cone;
    out += "<tr" + link_to({key_of(p.id)}) + "><td>" + std::to_string(p.id) + "</td><td>" + type_icon(p.type) + " " +
           name_of(p.type) + (p.concave ? " <span class=\"muted\">concave</span>" : "") +
           (p.fillet ? " <span class=\"muted\">fillet</span>" : "") + (p.name.empty() ? "" : " " + escaped(p.name)) +
           "</td>" + cell(number(p.area_mm2, 1)) + cell(round ? number(p.radius_mm, 3) : "–") +
           cell(high ? number(p.height_mm(), 2) : "–") + cell(high ? number(p.arc / kDegree, 0) : "–") +
           cell(p.type == PrimitiveType::sphere
                    ? "–"
                    : number(axis.x(), 4) + "  " + number(axis.y(), 4) + "  " + number(axis.z(), 4)) +
           cell(number(p.rms_mm, 4)) + cell(grouped(p.points)) + "</tr>";
  }
  return out + kTail + "</section>\n";
}

}  // namespace tribin::report
