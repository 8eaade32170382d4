// The run as a page, with the tokens and the style of all reports.
#include <algorithm>
#include <cctype>
#include <cmath>

#include "io/atomic_file.hpp"
#include "io/png.hpp"
#include "tribin/core/error.hpp"
#include "tribin/picking/report.hpp"
#include "tribin/report/page_kit.hpp"

namespace tribin::picking {
namespace {

constexpr int kWidth_px = 320;  // of a picture

using report::cell;
using report::escaped;
using report::number;
using report::section;

/// What an end means, in words: the page's first sentence, and whether it is as it should be.
struct Verdict {
  const char *status, *sentence, *state;
};
constexpr Verdict kVerdicts[] = {
    {"rack_full", "the rack is full", "ok"},
    {"empty", "the bin is empty", "ok"},
    {"most_parts", "as many as were asked for", "ok"},
    {"recovered", "nothing is open any more", "ok"},
    {"dry_run", "a dry run: nothing was moved", "ok"},
    {"not_pickable", "what is left cannot be picked", "warn"},
    {"not_empty_no_object", "something is left in which no part is found", "warn"},
    {"part_missing", "a slot waits for a part that is not seen", "warn"},
    {"no_data", "the scan shows nothing", "bad"},
    {"calibration_suspect", "the calibration is not to be trusted", "bad"},
    {"in_doubt", "an operator must look", "bad"},
};

Verdict verdict_of(const std::string& status) {
  for (const Verdict& verdict : kVerdicts)
    if (status == verdict.status) return verdict;
  return {"", "the run broke off", "bad"};
}

/// What became of a cycle, for people.
std::string words_of(const CycleReport& report) {
  const std::string slot = report.slot ? " in slot " + std::to_string(report.slot) : "";
  if (report.state == "placed") return report.part + " placed" + slot;
  if (report.state == "put_down") return report.part + " put down at the station";
  if (report.state == "missed") return report.part + " not held";
  if (report.state == "lost") return report.part + " lost on its way";
  if (report.state == "pushed") return report.part + " pushed";
  if (report.state == "planned") return report.part + " would be picked";
  return "nothing picked";
}

const char* state_of(const CycleReport& report) {
  const bool good = report.state == "placed" || report.state == "put_down" || report.state == "planned";
  return good ? "ok" : report.state == "lost" ? "bad" : "warn";
}

/// A resort's name for people; the first way needs none.
std::string words_of(Resort resort) {
  std::string out = resort == Resort::none ? "" : std::string(name_of(resort));
  std::replace(out.begin(), out.end(), '_', ' ');
  return out;
}

std::string text_cell(const std::string& text) { return "<td>" + escaped(text) + "</td>"; }

/// The rack from above: grids as they stand, given slots in one row.
std::string rack_section(const WorkCell& cell_file, const Filling& filling) {
  const std::vector<Slot> slots = slots_of(*cell_file.rack);
  const auto columns =
      cell_file.rack->given.empty() ? static_cast<std::size_t>(cell_file.rack->slots.columns) : slots.size();
  std::string out = section("rack", "Rack", "Slots in the order of filling, as the journal has them at the end.");
  out += "<div class=\"box\"><table><tbody>";
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (i % columns == 0) out += i ? "</tr><tr>" : "<tr>";
    int part_class = 0;
    for (std::size_t k = 0; k < cell_file.parts.size(); ++k)
      if (cell_file.parts[k].name == filling[i]) part_class = static_cast<int>(k);
    const std::string holds =
        filling[i].empty() ? "<span class=\"muted\">empty</span>"
                           : "<span class=\"name\">" + report::class_tag(part_class) + escaped(filling[i]) + "</span>";
    out += "<td><span class=\"muted\">" + std::to_string(slots[i].number) + "</span> " + holds + "</td>";
  }
  return out + "</tr></tbody></table></div></section>\n";
}

std::string reasons_section(const std::map<std::string, int>& reasons) {
  if (reasons.empty()) return {};
  std::vector<std::pair<std::string, int>> sorted(reasons.begin(), reasons.end());
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string out = section("refused", "Why grasps were refused",
                            "Candidates of all plans by the first check that they failed, in the words of the JSON.");
  out += "<div class=\"box\"><table><thead><tr><th>Check</th><th class=\"num\">Candidates</th></tr></thead><tbody>";
  for (const auto& [reason, count] : sorted) out += "<tr>" + text_cell(reason) + cell(report::grouped(count)) + "</tr>";
  return out + "</tbody></table></div></section>\n";
}

}  // namespace

Image<std::uint8_t> picture_of(const Scan& scan) {
  const int step = std::max(1, scan.z_mm.width / kWidth_px);
  Image<std::uint8_t> out(scan.z_mm.width / step, scan.z_mm.height / step);
  for (int v = 0; v < out.height; ++v)
    for (int u = 0; u < out.width; ++u) {
      const int x = std::clamp(u * step, step, scan.z_mm.width - step - 1),
                y = std::clamp(v * step, step, scan.z_mm.height - step - 1);
      const double z = scan.z_mm(x, y), right = scan.z_mm(x + step, y), below = scan.z_mm(x, y + step);
      if (!(z > 0) || !(right > 0) || !(below > 0)) continue;
      const double pitch = z * step / scan.camera.fx;  // mm between the pixels of the picture
      const Vec3 normal = Vec3((z - right) / pitch, (z - below) / pitch, 1).normalized();
      const double light = normal.dot(Vec3(0.4, 0.5, 1).normalized());
      out(u, v) = static_cast<std::uint8_t>(std::lround(30 + 225 * std::max(0.0, light)));
    }
  return out;
}

RunPage::RunPage(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::error_code failed;
  std::filesystem::create_directories(folder_, failed);
  if (failed) throw Error(ErrorCode::bad_input, folder_.string() + ": cannot be made: " + failed.message());
}

void RunPage::show(const Image<std::uint8_t>& picture) {
  if (!picture.empty()) pictures_.push_back(io::encode_png8(picture));
}

void RunPage::add(const CycleReport& report) { rows_.push_back({static_cast<int>(pictures_.size()), report}); }

/// One figure a scan: the bin as the camera saw it, and what came of it.
std::string RunPage::film() const {
  std::string out = section("film", "Film", "The bin as the camera saw it before each pick, and what came of it.");
  out += "<div class=\"pics\">";
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const int picture = rows_[i].first;
    if (picture == 0 || (i > 0 && rows_[i - 1].first == picture)) continue;
    out += "<figure><img alt=\"the bin, lit from the upper left\" src=\"data:image/png;base64," +
           report::base64(pictures_[static_cast<std::size_t>(picture) - 1]) + "\"><figcaption>";
    for (std::size_t k = i; k < rows_.size() && rows_[k].first == picture; ++k)
      out += (k > i ? "<br>" : "<b>" + std::to_string(rows_[k].second.scene) + "</b> ") +
             report::state_icon(state_of(rows_[k].second)) + " " + escaped(words_of(rows_[k].second));
    out += "</figcaption></figure>";
  }
  return out + "</div></section>\n";
}

std::string RunPage::cycles() const {
  std::string out = section("cycles", "Cycles", "One line for each thing that the robot did, or could not do.");
  out +=
      "<div class=\"box\"><table><thead><tr><th class=\"num\">Scan</th><th>What</th><th>Grasp</th>"
      "<th>Gripper</th><th>Resort</th><th class=\"num\">Score</th><th class=\"num\">Find" +
      report::unit("ms") + "</th><th class=\"num\">Since the scan" + report::unit("s") +
      "</th><th>Note</th></tr></thead><tbody>";
  for (const auto& [picture, row] : rows_) {
    const bool grasped = !row.grasp.empty();
    out += "<tr>" + cell(std::to_string(row.scene)) + "<td>" + report::state_icon(state_of(row)) + " " +
           escaped(words_of(row)) + "</td>" + text_cell(row.grasp) + text_cell(row.gripper) +
           text_cell(grasped ? words_of(row.resort) : "") + cell(grasped ? number(row.score, 3) : "") +
           cell(number(row.find_ms, 0)) + cell(number(row.robot_s, 1)) + "<td class=\"wrap\">" + escaped(row.note) +
           "</td></tr>";
  }
  return out + "</tbody></table></div></section>\n";
}

void RunPage::finish(const WorkCell& cell_file, const RunEnd& end, const Filling& filling) const {
  int missed = 0, anew = 0, pushed = 0;
  std::map<std::string, int> reasons;
  for (const auto& row : rows_) {
    missed += row.second.state == "missed", anew += row.second.state == "put_down",
        pushed += row.second.state == "pushed";
    for (const grasp::WhyCount& reason : row.second.refused) reasons[std::string(name_of(reason.why))] += reason.count;
  }
  const Verdict verdict = verdict_of(end.status);
  const bool one = end.placed == 1;
  const std::string first =
      std::to_string(end.placed) + (one ? " part placed: " : " parts placed: ") + verdict.sentence;
  std::string lead = escaped(end.message) + ".";
  if (end.message == verdict.sentence) lead.clear();
  if (!lead.empty()) lead[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(lead[0])));
  if (missed + anew + pushed > 0)
    lead += (lead.empty() ? "" : " ") + std::to_string(missed) + " grips held nothing, " + std::to_string(anew) +
            " parts were gripped anew at the station, " + std::to_string(pushed) + " were pushed.";
  std::vector<report::TocEntry> contents = {{"film", "Film"}, {"cycles", "Cycles"}};
  if (cell_file.rack) contents.insert(contents.begin() + 1, {"rack", "Rack"});
  if (!reasons.empty()) contents.push_back({"refused", "Why grasps were refused"});
  const std::string body =
      film() + (cell_file.rack ? rack_section(cell_file, filling) : "") + cycles() + reasons_section(reasons);
  io::write_file(folder_ / "index.html", report::page("tribin pick: " + cell_file.file.filename().string(), first, lead,
                                                      verdict.state, end.status, contents, body));
}

}  // namespace tribin::picking
