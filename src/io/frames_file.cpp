#include "tribin/io/frames_file.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/atomic_file.hpp"
#include "io/json_fields.hpp"
#include "io/png.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

using io::bad_file;
using io::JsonPlace;

/// One entry of "patterns"; a Gray entry without period_px is completed later.
struct Entry {
  std::string file;
  Pattern pattern;
};

Entry entry_of(const JsonPlace& object) {
  constexpr double kLarge = 1e9;
  object.must_be_object("{\"file\", \"kind\", ..}");
  Entry out;
  Pattern& p = out.pattern;
  out.file = object.at("file", "the image's name").text("the image's name");
  constexpr const char* kKinds = "phase, gray, gray_inverse, white or black";
  const std::string kind = object.at("kind", kKinds).text(kKinds);
  bool known = false;
  for (const PatternKind k :
       {PatternKind::phase, PatternKind::gray, PatternKind::gray_inverse, PatternKind::white, PatternKind::black})
    if (kind == name_of(k)) p.kind = k, known = true;
  if (!known) object.at("kind", "").fail(kKinds);
  const auto number = [&](const char* key, double least, const char* wanted, double& value) {
    if (object.has(key)) value = object.at(key, wanted).number(least, kLarge, wanted);
  };
  number("exposure_ms", 0, "a time >= 0", p.exposure_ms);
  if (p.kind == PatternKind::white || p.kind == PatternKind::black) return out;
  if (object.has("axis")) {
    const std::string axis = object.at("axis", "").text("column or row");
    if (axis != "column" && axis != "row") object.at("axis", "").fail("column or row");
    p.axis = axis == "row" ? PatternAxis::row : PatternAxis::column;
  }
  if (object.has("bit")) p.bit = object.at("bit", "").whole(0, 30, "the number of a bit, 0 = coarsest");
  number("period_px", 1e-3, "a length > 0", p.period_px);
  if (p.kind == PatternKind::phase) {
    if (p.period_px == 0) object.at("period_px", "the fringe period");
    constexpr const char* kShift = "the shift of a phase image";
    p.shift_rad = object.at("shift_deg", kShift).number(-kLarge, kLarge, kShift) * kDegree;
  } else if (p.period_px == 0 && p.bit < 0) {
    object.at("period_px", "the width of the words of a Gray image, or its bit");
  }
  return out;
}

/// Gray images that are only numbered: the finest one's words are a fringe wide.
void complete_periods(const JsonPlace& place, std::vector<Entry>& entries) {
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
    if (fringe == 0) place.fail("phase images of their axis beside Gray images that are only numbered");
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

void make_folder(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) bad_file(folder.string(), "folder", failed.message(), "a folder that can be written");
}

/// A pattern's entry in frames.json.
nlohmann::ordered_json entry_json(const Pattern& p, const std::string& file) {
  nlohmann::ordered_json entry{{"file", file}, {"kind", name_of(p.kind)}};
  if (p.kind != PatternKind::white && p.kind != PatternKind::black) {
    entry["axis"] = name_of(p.axis);
    entry["period_px"] = p.period_px;
  }
  if (p.kind == PatternKind::phase) entry["shift_deg"] = p.shift_rad / kDegree;
  if (p.bit >= 0) entry["bit"] = p.bit;
  return entry;
}

}  // namespace

std::vector<FrameStack> read_frames(const std::filesystem::path& folder, const std::filesystem::path& frames_file) {
  const io::FileBytes file = io::read_file(frames_file.empty() ? folder / "frames.json" : frames_file);
  const nlohmann::json document = io::parse_json(file, "frames.json");
  const JsonPlace top(file.name, document, JsonPlace::kTop);
  int width = 0, height = 0;
  if (top.has("projector") && !top.at("projector", "").value().is_null()) {
    constexpr const char* kSize = "{\"width\", \"height\"} in pixels, 1..65535";
    width = top.at("projector", kSize).at("width", kSize).whole(1, 65535, kSize);
    height = top.at("projector", kSize).at("height", kSize).whole(1, 65535, kSize);
  }
  constexpr const char* kCameras = "a list of one camera or more";
  const JsonPlace cameras = top.at("cameras", kCameras);
  if (cameras.array_size(kCameras) == 0) cameras.fail(kCameras);
  std::vector<FrameStack> out;
  for (std::size_t c = 0; c < cameras.array_size(kCameras); ++c) {
    const JsonPlace camera = cameras.at(c), patterns = camera.at("patterns", "a list of patterns");
    if (patterns.array_size("a list of patterns") == 0) patterns.fail("a list of patterns");
    std::vector<Entry> entries;
    for (std::size_t i = 0; i < patterns.value().size(); ++i) entries.push_back(entry_of(patterns.at(i)));
    complete_periods(patterns, entries);
    out.push_back(read_stack(folder, camera.at("camera", "its name").text("its name"), entries));
    out.back().projector_width = width, out.back().projector_height = height;
  }
  return out;
}

void write_patterns(const std::filesystem::path& folder, const std::vector<Pattern>& patterns, int width, int height,
                    double gamma, const std::vector<std::string>& cameras) {
  make_folder(folder);
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const std::string name = pattern_file_name(patterns, i);
    io::write_file(folder / name, io::encode_png8(draw_pattern(patterns[i], width, height, gamma)));
    list.push_back(entry_json(patterns[i], name));
  }
  nlohmann::ordered_json out;
  out["projector"] = {{"width", width}, {"height", height}};
  out["cameras"] = nlohmann::ordered_json::array();
  for (const std::string& camera : cameras)
    out["cameras"].push_back(nlohmann::ordered_json{{"camera", camera}, {"patterns", list}});
  io::write_file(folder / "frames.json", out.dump(1) + "\n");
}

void write_frames(const std::filesystem::path& folder, const FrameStack& frames) {
  TRIBIN_ASSERT(frames.files.size() == frames.patterns.size() && frames.grey16.size() <= frames.patterns.size());
  make_folder(folder);
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < frames.patterns.size(); ++i) {
    io::write_file(folder / frames.files[i],
                   frames.grey8.empty() ? io::encode_png16(frames.grey16.at(i)) : io::encode_png8(frames.grey8.at(i)));
    list.push_back(entry_json(frames.patterns[i], frames.files[i]));
  }
  nlohmann::ordered_json out;
  if (frames.projector_width > 0)
    out["projector"] = {{"width", frames.projector_width}, {"height", frames.projector_height}};
  out["cameras"] = {nlohmann::ordered_json{{"camera", frames.camera}, {"patterns", list}}};
  io::write_file(folder / "frames.json", out.dump(1) + "\n");
}

}  // namespace tribin
