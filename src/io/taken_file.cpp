#include "tribin/io/taken_file.hpp"

#include <chrono>
#include <cstdio>

#include "io/atomic_file.hpp"
#include "io/pose_json.hpp"
#include "io/taken.hpp"
#include "tribin/core/content_hash.hpp"

namespace tribin {
namespace {

using io::JsonPlace;

constexpr const char* kTimeWanted = "a time as 2026-11-22T11:15:03.250Z (UTC)";

std::int64_t time_at(const JsonPlace& place) {
  const std::string text = place.text(kTimeWanted);
  try {
    return time_from_text(text);
  } catch (const Error&) {
    place.fail(kTimeWanted);
  }
}

struct TakenFile {
  Taken taken;
  std::string scan_hash;
};

TakenFile parse_taken(const io::FileBytes& file) {
  const nlohmann::json document = io::parse_json(file, "the time and place of a scan");
  const JsonPlace top(file.name, document, JsonPlace::kTop);
  top.must_be_object("{\"time\", \"base_from_flange\"}");
  top.only_keys({"scan_hash", "time", "base_from_flange"});
  TakenFile out;
  if (top.has("scan_hash")) out.scan_hash = top.at("scan_hash", "").text("32 hexadecimal digits");
  if (top.has("time")) out.taken.time_ms = time_at(top.at("time", ""));
  if (!top.has("base_from_flange")) return out;
  const JsonPlace pose = top.at("base_from_flange", "");
  pose.must_be_object("a pose");
  pose.only_keys({"time", "rotation", "rotation_vector_rad", "translation_mm", "convention", "pose"});
  if (pose.has("time")) out.taken.flange_time_ms = time_at(pose.at("time", ""));
  out.taken.base_from_flange = pose.has("convention") ? io::robot_pose_of(pose.at("pose", "the numbers of the pose"),
                                                                          io::convention_of(pose.at("convention", "")))
                                                      : io::pose_of(pose);
  return out;
}

}  // namespace

std::filesystem::path taken_file_of(const std::filesystem::path& scan) {
  std::filesystem::path beside = scan;
  return beside.replace_extension(".taken.json");
}

Taken read_taken_file(const std::filesystem::path& path) { return parse_taken(io::read_file(path)).taken; }

void write_taken_file(const std::filesystem::path& path, const Taken& taken, std::string_view scan_bytes) {
  nlohmann::ordered_json out = nlohmann::ordered_json::object();
  if (!scan_bytes.empty()) out["scan_hash"] = hex_of(content_hash(scan_bytes));
  if (taken.time_ms) out["time"] = text_of_time(*taken.time_ms);
  if (taken.base_from_flange) {
    nlohmann::ordered_json& pose = out["base_from_flange"];
    pose = io::json_of(*taken.base_from_flange);
    if (taken.flange_time_ms) pose["time"] = text_of_time(*taken.flange_time_ms);
  }
  io::write_file(path, out.dump(1) + "\n");
}

std::string text_of_time(std::int64_t time_ms) {
  using namespace std::chrono;
  const sys_time<milliseconds> time{milliseconds(time_ms)};
  const auto day = floor<days>(time);
  const year_month_day date(day);
  const hh_mm_ss clock(time - day);
  char text[40];
  std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02d.%03dZ", int(date.year()), unsigned(date.month()),
                unsigned(date.day()), int(clock.hours().count()), int(clock.minutes().count()),
                int(clock.seconds().count()), int(clock.subseconds().count()));
  return text;
}

std::int64_t time_from_text(const std::string& text) {
  using namespace std::chrono;
  int y = 0, read = 0;
  unsigned m = 0, d = 0, h = 0, min = 0, s = 0, ms = 0;
  const bool form =
      std::sscanf(text.c_str(), "%4d-%2u-%2uT%2u:%2u:%2u.%3uZ%n", &y, &m, &d, &h, &min, &s, &ms, &read) == 7;
  const year_month_day date{year(y), month(m), day(d)};
  // The text of the time must be the text: that refuses one-digit months, days that do not exist, and what follows.
  if (form && date.ok()) {
    const std::int64_t time = sys_days(date).time_since_epoch().count() * std::int64_t{86'400'000} +
                              ((h * 60 + min) * std::int64_t{60} + s) * 1000 + ms;
    if (text_of_time(time) == text) return time;
  }
  throw Error(ErrorCode::bad_input, "saw " + io::in_quotes(text) + ", wanted " + kTimeWanted);
}

Pose robot_pose_from_text(const std::string& text) {
  // One reader for poses: the text becomes the JSON that it stands for.
  const std::string source = "pose " + io::in_quotes(text);
  const auto space = text.find(' ');
  nlohmann::json numbers = nlohmann::json::array();
  try {
    std::size_t at = space == std::string::npos ? text.size() : space;
    while ((at = text.find_first_not_of(" ,", at)) != std::string::npos) {
      std::size_t used = 0;
      numbers.push_back(std::stod(text.substr(at), &used));
      at += used;
    }
  } catch (const std::exception&) {
    throw Error(ErrorCode::bad_option,
                source + ": wanted a maker's convention and its numbers, as in \"yaskawa 600 0 900 180 0 0\"");
  }
  const nlohmann::json name = text.substr(0, space);
  try {
    return io::robot_pose_of({source, numbers, ""}, io::convention_of({source, name, ""}));
  } catch (const Error& e) {
    throw Error(ErrorCode::bad_option, e.what());
  }
}

namespace io {

void read_taken(const std::filesystem::path& scan, std::string_view bytes, Taken& taken,
                std::vector<std::string>& warnings) {
  const std::filesystem::path beside = taken_file_of(scan);
  if (!std::filesystem::is_regular_file(beside)) return;
  TakenFile file = parse_taken(read_file(beside));
  if (!file.scan_hash.empty() && file.scan_hash != hex_of(content_hash(bytes))) {
    warnings.push_back(beside.filename().string() + " is of another scan (its scan_hash differs) and is not used");
    return;
  }
  taken = std::move(file.taken);
}

void write_scan_file(const std::filesystem::path& path, const Taken& taken, std::string_view bytes) {
  write_file(path, bytes);
  if (taken.known()) write_taken_file(taken_file_of(path), taken, bytes);
}

}  // namespace io

}  // namespace tribin
