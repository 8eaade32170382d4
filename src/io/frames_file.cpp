#include "tribin/io/frames_file.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/atomic_file.hpp"
#include "io/file_bytes.hpp"
#include "io/png.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

using io::bad_file;
using nlohmann::json;

/// One entry of "patterns"; a Gray entry without period_px is completed later.
struct Entry {
  std::string file;
  Pattern pattern;
};

std::string text_at(const std::string& file, const std::string& place, const json& object, const char* key) {
  if (!object.contains(key) || !object.at(key).is_string())
    bad_file(file, place + key, object.contains(key) ? io::in_quotes(object.at(key).dump()) : "nothing", "a text");
  return object.at(key).get<std::string>();
}

double number_at(const std::string& file, const std::string& place, const json& object, const char* key, double least) {
  const json& value = object.at(key);
  if (!value.is_number() || !std::isfinite(value.get<double>()) || value.get<double>() < least)
    bad_file(file, place + key, io::in_quotes(value.dump()),
             least > -1e300 ? "a number >= " + std::to_string(least) : "a number");
  return value.get<double>();
}

Entry entry_of(const std::string& file, const std::string& place, const json& object) {
  constexpr double kAny = -1e308;
  if (!object.is_object()) bad_file(file, place, io::in_quotes(object.dump()), "an object");
  Entry out;
  out.file = text_at(file, place, object, "file");
  const std::string kind = text_at(file, place, object, "kind");
  bool known = false;
  for (const PatternKind k :
       {PatternKind::phase, PatternKind::gray, PatternKind::gray_inverse, PatternKind::white, PatternKind::black})
    if (kind == name_of(k)) out.pattern.kind = k, known = true;
  if (!known) bad_file(file, place + "kind", io::in_quotes(kind), "phase, gray, gray_inverse, white or black");
  if (object.contains("exposure_ms")) out.pattern.exposure_ms = number_at(file, place, object, "exposure_ms", 0);
  if (out.pattern.kind == PatternKind::white || out.pattern.kind == PatternKind::black) return out;
  if (object.contains("axis")) {
    const std::string axis = text_at(file, place, object, "axis");
    if (axis != "column" && axis != "row") bad_file(file, place + "axis", io::in_quotes(axis), "column or row");
    out.pattern.axis = axis == "row" ? PatternAxis::row : PatternAxis::column;
  }
  if (object.contains("bit")) out.pattern.bit = static_cast<int>(number_at(file, place, object, "bit", 0));
  if (object.contains("period_px")) out.pattern.period_px = number_at(file, place, object, "period_px", 1e-3);
  if (out.pattern.kind == PatternKind::phase) {
    if (out.pattern.period_px == 0) bad_file(file, place + "period_px", "nothing", "the fringe period");
    if (!object.contains("shift_deg")) bad_file(file, place + "shift_deg", "nothing", "the shift of a phase image");
    out.pattern.shift_rad = number_at(file, place, object, "shift_deg", kAny) * kDegree;
  } else if (out.pattern.period_px == 0 && out.pattern.bit < 0) {
    bad_file(file, place + "period_px", "neither period_px nor bit", "the width of the words of a Gray image");
  }
  return out;
}

/// Gray images that are only numbered: the finest one's words are a fringe wide.
void complete_periods(const std::string& file, const std::string& place, std::vector<Entry>& entries) {
  for (Entry& e : entries) {
    Pattern& p = e.pattern;
    if (p.period_px > 0 || p.kind == PatternKind::white || p.kind == PatternKind::black) continue;
    int finest = 0;
    double fringe = 0;
    for (const Entry& other : entries) {
      if (other.pattern.axis != p.axis) continue;
      finest = std::max(finest, other.pattern.bit);
      if (other.pattern.kind == PatternKind::phase)
        fringe = fringe == 0 ? other.pattern.period_px : std::min(fringe, other.pattern.period_px);
    }
    if (fringe == 0) bad_file(file, place, "numbered Gray images without phase images", "phase images of their axis");
    p.period_px = std::ldexp(fringe, finest - p.bit);
  }
}

FrameStack read_stack(const std::filesystem::path& folder, const std::string& camera,
                      const std::vector<Entry>& entries) {
  FrameStack out;
  out.camera = camera;
  std::vector<io::GreyImage> images(entries.size());
  parallel_each(static_cast<int>(entries.size()), [&](int i) {
    images[static_cast<std::size_t>(i)] =
        io::decode_grey_png(io::read_file(folder / entries[static_cast<std::size_t>(i)].file));
  });
  const bool wide = std::any_of(images.begin(), images.end(), [](const auto& i) { return i.grey8.empty(); });
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (wide != images[i].grey8.empty())
      bad_file(entries[i].file, "byte 24", "8 bits", "16 bits as other images of camera " + camera);
    out.patterns.push_back(entries[i].pattern);
    out.files.push_back(entries[i].file);
    if (wide)
      out.grey16.push_back(std::move(images[i].grey16));
    else
      out.grey8.push_back(std::move(images[i].grey8));
  }
  return out;
}

}  // namespace

std::vector<FrameStack> read_frames(const std::filesystem::path& folder, const std::filesystem::path& frames_file) {
  const io::FileBytes file = io::read_file(frames_file.empty() ? folder / "frames.json" : frames_file);
  json top;
  try {
    top = json::parse(file.data);
  } catch (const json::parse_error& error) {
    bad_file(file.name, io::at_line(file.view(), error.byte), "text that is no JSON", "frames.json");
  }
  if (!top.is_object() || !top.contains("cameras") || !top.at("cameras").is_array() || top.at("cameras").empty())
    bad_file(file.name, "cameras", "nothing", "a list of one camera or more");
  std::vector<FrameStack> out;
  for (std::size_t c = 0; c < top.at("cameras").size(); ++c) {
    const json& object = top.at("cameras")[c];
    const std::string place = "cameras[" + std::to_string(c) + "].";
    if (!object.is_object() || !object.contains("patterns") || !object.at("patterns").is_array() ||
        object.at("patterns").empty())
      bad_file(file.name, place + "patterns", "nothing", "a list of patterns");
    std::vector<Entry> entries;
    for (std::size_t i = 0; i < object.at("patterns").size(); ++i)
      entries.push_back(entry_of(file.name, place + "patterns[" + std::to_string(i) + "].", object.at("patterns")[i]));
    complete_periods(file.name, place + "patterns", entries);
    out.push_back(read_stack(folder, text_at(file.name, place, object, "camera"), entries));
  }
  return out;
}

void write_patterns(const std::filesystem::path& folder, const std::vector<Pattern>& patterns, int width, int height,
                    double gamma, const std::vector<std::string>& cameras) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) bad_file(folder.string(), "folder", failed.message(), "a folder that can be written");
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const Pattern& p = patterns[i];
    const std::string name = pattern_file_name(patterns, i);
    io::write_file(folder / name, io::encode_png8(draw_pattern(p, width, height, gamma)));
    nlohmann::ordered_json entry{{"file", name}, {"kind", name_of(p.kind)}};
    if (p.kind != PatternKind::white && p.kind != PatternKind::black) {
      entry["axis"] = name_of(p.axis);
      entry["period_px"] = p.period_px;
    }
    if (p.kind == PatternKind::phase) entry["shift_deg"] = p.shift_rad / kDegree;
    if (p.bit >= 0) entry["bit"] = p.bit;
    list.push_back(entry);
  }
  nlohmann::ordered_json out;
  out["projector"] = {{"width", width}, {"height", height}};
  out["cameras"] = nlohmann::ordered_json::array();
  for (const std::string& camera : cameras)
    out["cameras"].push_back(nlohmann::ordered_json{{"camera", camera}, {"patterns", list}});
  io::write_file(folder / "frames.json", out.dump(1) + "\n");
}

}  // namespace tribin
