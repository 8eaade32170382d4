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

/// The images of a stack, all of 8 or all of 16 bit.
void read_images(const std::filesystem::path& folder, FrameStack& out) {
  std::vector<io::GreyImage> images(out.files.size());
  parallel_each(static_cast<int>(images.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    images[k] = io::decode_grey_png(io::read_file(folder / out.files[k]));
  });
  const bool wide = std::any_of(images.begin(), images.end(), [](const auto& i) { return i.grey8.empty(); });
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (wide != images[i].grey8.empty())
      bad_file(out.files[i], "byte 24", "8 bits", "16 bits as other images of camera " + out.camera);
    if (wide)
      out.grey16.push_back(std::move(images[i].grey16));
    else
      out.grey8.push_back(std::move(images[i].grey8));
  }
}

/// What frames.json says of each camera.
std::vector<FrameStack> read_list(const std::filesystem::path& path) {
  const io::FileBytes file = io::read_file(path);
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
  std::vector<FrameStack> out(cameras.array_size(kCameras));
  for (std::size_t c = 0; c < out.size(); ++c) {
    const JsonPlace camera = cameras.at(c), patterns = camera.at("patterns", "a list of patterns");
    if (patterns.array_size("a list of patterns") == 0) patterns.fail("a list of patterns");
    std::vector<Entry> entries;
    for (std::size_t i = 0; i < patterns.value().size(); ++i) entries.push_back(entry_of(patterns.at(i)));
    complete_periods(patterns, entries);
    FrameStack& stack = out[c];
    stack.camera = camera.at("camera", "its name").text("its name");
    constexpr const char* kScale = "the largest grey value that the camera gives, 1..65535";
    if (camera.has("full_scale")) stack.full_scale = camera.at("full_scale", kScale).number(1, 65535, kScale);
    stack.projector_width = width, stack.projector_height = height;
    for (Entry& entry : entries) {
      stack.patterns.push_back(entry.pattern);
      stack.files.push_back(std::move(entry.file));
    }
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
  if (p.exposure_ms > 0) entry["exposure_ms"] = p.exposure_ms;
  return entry;
}

}  // namespace

std::vector<FrameStack> read_frames(const std::filesystem::path& folder, const std::filesystem::path& frames_file) {
  std::vector<FrameStack> out = read_list(frames_file.empty() ? folder / "frames.json" : frames_file);
  for (FrameStack& stack : out) read_images(folder, stack);
  return out;
}

FrameStack read_sequence(const std::filesystem::path& path) {
  const std::filesystem::path file = std::filesystem::is_directory(path) ? path / "frames.json" : path;
  std::vector<FrameStack> out = read_list(file);
  if (out.size() != 1)
    bad_file(file.string(), "cameras", std::to_string(out.size()) + " cameras", "the patterns of one");
  return std::move(out[0]);
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

void write_frames(const std::filesystem::path& folder, const std::vector<FrameStack>& stacks) {
  make_folder(folder);
  nlohmann::ordered_json out;
  if (!stacks.empty() && stacks[0].projector_width > 0)
    out["projector"] = {{"width", stacks[0].projector_width}, {"height", stacks[0].projector_height}};
  out["cameras"] = nlohmann::ordered_json::array();
  for (std::size_t c = 0; c < stacks.size(); ++c) {
    const FrameStack& frames = stacks[c];
    TRIBIN_ASSERT(frames.grey8.size() + frames.grey16.size() == frames.patterns.size());
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < frames.patterns.size(); ++i) {
      // Names of the recording itself: those of a foreign folder may lead anywhere.
      const std::string name =
          (stacks.size() > 1 ? std::to_string(c) + "_" : "") + pattern_file_name(frames.patterns, i);
      io::write_file(folder / name,
                     frames.grey8.empty() ? io::encode_png16(frames.grey16[i]) : io::encode_png8(frames.grey8[i]));
      list.push_back(entry_json(frames.patterns[i], name));
    }
    nlohmann::ordered_json camera{{"camera", frames.camera}};
    if (frames.full_scale > 0) camera["full_scale"] = frames.full_scale;
    camera["patterns"] = std::move(list);
    out["cameras"].push_back(std::move(camera));
  }
  io::write_file(folder / "frames.json", out.dump(1) + "\n");
}

}  // namespace tribin
