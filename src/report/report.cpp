#include "tribin/report/report.hpp"

#include <fstream>

#include "report/html.hpp"
#include "report/links.hpp"
#include "report/pictures.hpp"
#include "report/sections.hpp"
#include "tribin/core/error.hpp"
#include "tribin/report/json.hpp"
#include "tribin/report/summary.hpp"

namespace tribin {
namespace {

using report::TocEntry;

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw Error(ErrorCode::bad_option, path.string() + ": cannot be written");
}

void write_page(const std::filesystem::path& dir, const std::string& html, const std::string& json) {
  std::error_code error;
  std::filesystem::create_directories(dir, error);
  if (error) throw Error(ErrorCode::bad_option, dir.string() + ": cannot be made: " + error.message());
  write(dir / "index.html", html);
  write(dir / "report.json", json);
}

/// Pictures shrink with the number of parts, so that the page stays below 3 MB.
int picture_size(std::size_t parts) { return parts <= 2 ? 480 : parts <= 4 ? 340 : 240; }
constexpr std::size_t kPicturedParts = 8;

std::string lead_of(const Scan& scan, const Found& found, std::span<const Part> parts) {
  std::string out = "Looked for " + std::to_string(parts.size()) + (parts.size() == 1 ? " part" : " parts") + " in " +
                    report::escaped(std::filesystem::path(scan.source).filename().string()) + ", " +
                    std::to_string(scan.width()) + " × " + std::to_string(scan.height()) + " px, " +
                    report::grouped(static_cast<long long>(valid_count(scan))) + " points.";
  const auto& items = found.instances.items;
  std::size_t open = 0, undecided = 0;
  for (const Instance& instance : items) {
    open += !instance.weak_directions.empty() || !instance.free_directions.empty();
    undecided += !instance.alternatives.empty();
  }
  if (!items.empty() && open + undecided == 0)
    out +=
        items.size() == 1 ? " Its pose is fixed in all six directions." : " All poses are fixed in all six directions.";
  if (open > 0)
    out +=
        " " + std::to_string(open) + " of " + std::to_string(items.size()) + " poses leave a direction free or weak.";
  if (undecided > 0)
    out += " " + std::to_string(undecided) + " of " + std::to_string(items.size()) +
           " have another pose that the data does not rule out.";
  return out;
}

const Instance* best_of(const Found& found, const std::string& part) {
  for (const Instance& instance : found.instances.items)
    if (instance.part == part) return &instance;
  return nullptr;
}

}  // namespace

void write_locate_report(const std::filesystem::path& dir, const Scan& scan, std::span<const Part> parts,
                         const Found& found, const ReportContext& context, const std::optional<ReportTruth>& truth) {
  const report::Observation seen{scan, found.surfels, found.primitives};
  std::string pictures =
      report::section("pictures", "Ten pictures a part",
                      "The same ten as figures 4 and 5 of the paper, from this scan; each part where it was found "
                      "best. Point at a surface in one picture and it lights up in the "
                      "others; click holds it.");
  for (std::size_t i = 0; i < parts.size() && i < kPicturedParts; ++i) {
    const Instance* instance = best_of(found, parts[i].name);
    pictures += "<div data-part=\"" + report::escaped(parts[i].name) + "\"><h3>" +
                report::class_tag(static_cast<int>(i)) + report::escaped(parts[i].name) +
                (instance ? "" : " <span class=\"muted\">not found: its CAD alone</span>") +
                "</h3><div class=\"pics\">" +
                report::ten_pictures(seen, parts[i], instance, static_cast<int>(i), picture_size(parts.size())) +
                "</div></div>";
  }
  pictures += report::picture_legend() + "</section>\n";

  std::vector<TocEntry> contents = {
      {"poses", "Poses"}, {"pictures", "Ten pictures"}, {"evidence", "Evidence"}, {"why", "Why not?"}};
  std::string body =
      report::warning_lines(found.warnings, scan.warnings) + report::poses_section(scan, parts, found, truth) +
      report::overview(seen, parts, found.instances.items) + pictures + report::evidence_section(parts, found) +
      report::why_not_section(parts, found) + report::bin_section(scan, found);
  if (found.bin || !found.instances.unexplained.empty()) contents.push_back({"bin", "Bin and the rest"});
  if (context.times) {
    contents.push_back({"time", "Time"});
    body += report::time_section(found.times, context.threads);
  }
  contents.push_back({"again", "Run it again"});
  body += report::again_section(context);
  const std::string state = found.instances.items.empty() ? "warn" : "ok";
  std::string chip = "status " + found.status;
  if (context.times) chip += ", " + report::number(found.times.total(), 1) + " ms";
  const std::string sentence = verdict(found, parts);
  write_page(dir,
             report::page("tribin: " + sentence, sentence, lead_of(scan, found, parts), state, chip, contents, body),
             locate_json(scan, found, {.times = context.times}));
}

void write_segment_report(const std::filesystem::path& dir, const Surfels& surfels, const Primitives& primitives,
                          const PrimitiveModel& model, const StageTimes& times, const std::vector<Warning>& warnings,
                          const ReportContext& context) {
  const bool scan = surfels.scan != nullptr;
  int count[5] = {0, 0, 0, 0, 0};
  for (const Primitive& p : primitives.items) ++count[static_cast<int>(p.type)];
  const char* const one[] = {"plane", "cylinder", "cone", "sphere", "torus"};
  const char* const many[] = {"planes", "cylinders", "cones", "spheres", "tori"};
  std::string sentence;
  for (int i = 0; i < 5; ++i)
    if (count[i] > 0 || i < 2)
      sentence += (sentence.empty() ? "" : ", ") + std::to_string(count[i]) + " " + (count[i] == 1 ? one : many)[i];
  std::vector<TocEntry> contents = {{"pictures", "Pictures"}, {"primitives", "Primitives"}};
  std::string body =
      report::warning_lines(warnings, scan ? surfels.scan->warnings : surfels.point_set->warnings) +
      report::section("pictures", scan ? "Seven pictures" : "Pictures", "") + "<div class=\"pics\">" +
      (scan ? report::scan_pictures({*surfels.scan, surfels, primitives}, 480)
            : report::cloud_pictures(surfels, primitives, 480)) +
      "</div>" + report::picture_legend() + "</section>\n" +
      report::primitives_section(primitives.items, scan ? surfels.scan->input_from_camera : Pose::Identity(),
                                 "In the input's frame.", report::scan_key);
  if (context.times) {
    contents.push_back({"time", "Time"});
    body += report::time_section(times, context.threads);
  }
  contents.push_back({"again", "Run it again"});
  body += report::again_section(context);
  const std::string file =
      std::filesystem::path(scan ? surfels.scan->source : surfels.point_set->source).filename().string();
  write_page(dir, report::page("tribin: " + file, sentence + " in " + file, "", "ok", "segmented", contents, body),
             segment_json(surfels, primitives, model, times, warnings, {.times = context.times}));
}

void write_part_report(const std::filesystem::path& dir, const Part& part, const std::string& file,
                       const StageTimes& times, const ReportContext& context) {
  const Vec3 size = part.box_max - part.box_min;
  const std::size_t turns = part.symmetry.discrete.size() > 1 ? part.symmetry.discrete.size() - 1 : 0;
  std::string lead = report::number(size.x(), 1) + " × " + report::number(size.y(), 1) + " × " +
                     report::number(size.z(), 1) + " mm, diameter " + report::number(part.diameter_mm, 1) + " mm. ";
  lead += !part.symmetry.continuous.empty() ? "Turning about one axis leaves it as it is. "
          : turns == 0
              ? "No turn leaves it as it is. "
              : std::to_string(turns) + (turns == 1 ? " turn leaves it as it is. " : " turns leave it as it is. ");
  if (!part.self_similar.empty())
    lead += std::to_string(part.self_similar.size()) + " further pose" +
            (part.self_similar.size() == 1 ? " leaves" : "s leave") +
            " most of its surface in place: these are the ones to mistake it for.";
  const std::string body = report::warning_lines({}, part.warnings) + report::section("pictures", "Pictures", "") +
                           "<div class=\"two\">" + report::part_pictures(part, 0, 720) + "</div>" +
                           report::picture_legend() + "</section>\n" +
                           report::primitives_section(part.model.primitives, Pose::Identity(), "In the CAD's frame.",
                                                      [](int id) { return report::cad_key(0, id); }) +
                           report::again_section(context);
  write_page(dir,
             report::page("tribin: " + part.name, part.name, lead, part.warnings.empty() ? "ok" : "warn", "compiled",
                          {{"pictures", "Pictures"}, {"primitives", "Primitives"}, {"again", "Run it again"}}, body),
             part_json(part, file, times, {.times = context.times}));
}

}  // namespace tribin
