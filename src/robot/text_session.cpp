#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "tribin/core/error.hpp"
#include "tribin/robot/text_protocol.hpp"

namespace tribin::robot {
namespace {

constexpr int kVersion = 1;
constexpr int kPosesOfPick = 3;

std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields;
  while (true) {
    const std::size_t comma = line.find(',');
    std::string_view field = line.substr(0, comma);
    while (!field.empty() && field.front() == ' ') field.remove_prefix(1);
    while (!field.empty() && field.back() == ' ') field.remove_suffix(1);
    fields.emplace_back(field);
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

/// Whole numbers as robots write them: "3", "3.0", "+3".
std::optional<int> whole(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (!(std::abs(value) <= 1e6) || value != std::floor(value)) return std::nullopt;
  return static_cast<int>(value);
}

std::string number(double value, int decimals) {
  char text[64];
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, decimals);
  std::string out(text, end.ptr);
  if (out.front() == '-' && out.find_first_not_of("-0.") == std::string::npos) out.erase(0, 1);  // no -0.000
  return out;
}

bool may_be_given(const std::vector<Pose>& poses, const SafetyLimits& limits) {
  CommandFacts facts;
  facts.kind = CommandKind::motion;
  facts.motion.base_from_tcp = poses;
  for (const Refusal& refusal : refusals(facts, limits))
    if (refusal.code == RefusalCode::not_finite || refusal.code == RefusalCode::not_rotation ||
        refusal.code == RefusalCode::workspace || refusal.code == RefusalCode::forbidden)
      return false;
  return true;
}

}  // namespace

std::string TextSession::say(TextStatus status, const std::string& rest) const {
  return std::to_string(static_cast<int>(status)) + (rest.empty() ? "" : "," + rest) + "\r\n";
}

std::string TextSession::pose_line(const TextPick& pick, int step, const Pose& pose) const {
  std::string line =
      "P," + std::to_string(pick.id) + "," + std::to_string(step) + "," + std::to_string(pick.part_class);
  const std::vector<double> numbers = numbers_from_pose(convention_, pose);
  const bool metres = position_unit_mm(convention_) != 1;
  const bool small = rotation_numbers(convention_) == 4 || convention_ == Convention::ur;  // quaternions and radians
  for (std::size_t i = 0; i < numbers.size(); ++i)
    line += "," + number(numbers[i], i < 3 ? (metres ? 6 : 3) : (small ? 6 : 4));
  return line + "\r\n";
}

const TextPick* TextSession::find(int id) const {
  for (const TextPick& pick : now_.picks)
    if (pick.id == id) return &pick;
  return nullptr;
}

bool TextSession::scan_is_usable() const {
  return scene_ > 0 && clock_.now_s() - scan_time_s_ <= options_.limits.scan_max_age_s;
}

std::string TextSession::hello(const std::vector<std::string>& fields) {
  if (fields.size() < 3 || fields.size() > 4) return say(TextStatus::wrong_fields, "wanted HELLO,1,convention[,key]");
  if (whole(fields[1]) != kVersion) return say(TextStatus::out_of_range, "version 1 is spoken here");
  if (!options_.key.empty() && (fields.size() != 4 || fields[3] != options_.key)) {
    over_ = true;
    return say(TextStatus::wrong_key);
  }
  std::string name = fields[2];
  for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  try {
    convention_ = convention_from_name(name);
  } catch (const Error&) {
    return say(TextStatus::unknown_convention, "yaskawa fanuc kuka mitsubishi kawasaki abb ur ros");
  }
  greeted_ = true;
  return say(TextStatus::hello, std::to_string(kVersion) + ",tribin");
}

std::string TextSession::scan() {
  TextScene scene;
  try {
    scene = vision_.scan();
  } catch (const std::exception& error) {
    now_ = {};
    changed_ = true;
    std::string text = error.what();
    std::replace_if(
        text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 32 || c == ','; }, ' ');
    return say(TextStatus::vision_failed, text.substr(0, kLongestTextLine - 6));
  }
  ++scene_;
  scan_time_s_ = clock_.now_s();
  changed_ = false;
  next_ = 0;
  const std::size_t found = scene.picks.size();
  std::erase_if(scene.picks, [this](const TextPick& pick) {
    return !may_be_given({pick.pick.begin(), pick.pick.end()}, options_.limits) ||
           (!pick.place.empty() && !may_be_given(pick.place, options_.limits));
  });
  if (scene.status == TextStatus::scanned && scene.picks.empty())
    scene.status = found > 0 ? TextStatus::not_pickable : TextStatus::no_object;
  if (scene.status != TextStatus::scanned) scene.picks.clear();
  now_ = std::move(scene);
  return say(now_.status, std::to_string(scene_) + "," + std::to_string(now_.picks.size()));
}

std::string TextSession::get(const std::vector<std::string>& fields) {
  if (fields.size() != 2 || !whole(fields[1])) return say(TextStatus::wrong_fields, "wanted GET,most poses");
  const int most = *whole(fields[1]);
  if (most < kPosesOfPick || most > 300) return say(TextStatus::out_of_range, "3 to 300 poses; a pick takes 3");
  if (!scan_is_usable()) return say(TextStatus::scan_first);
  if (changed_) return say(TextStatus::scene_changed);
  const std::size_t count =
      std::min<std::size_t>(static_cast<std::size_t>(most / kPosesOfPick), now_.picks.size() - next_);
  std::string out = say(TextStatus::poses_follow, std::to_string(scene_) + "," + std::to_string(count * kPosesOfPick) +
                                                      "," + std::to_string(now_.picks.size() - next_ - count));
  for (std::size_t i = 0; i < count; ++i) {
    const TextPick& pick = now_.picks[next_++];
    for (int step = 0; step < kPosesOfPick; ++step)
      out += pose_line(pick, step + 1, pick.pick[static_cast<std::size_t>(step)]);
  }
  return out;
}

std::string TextSession::place(const std::vector<std::string>& fields) {
  if (fields.size() != 2 || !whole(fields[1])) return say(TextStatus::wrong_fields, "wanted PLACE,pick");
  const TextPick* pick = find(*whole(fields[1]));
  if (!pick || pick->place.empty()) return say(TextStatus::no_such_pick);
  std::string out =
      say(TextStatus::poses_follow, std::to_string(scene_) + "," + std::to_string(pick->place.size()) + ",0");
  for (std::size_t i = 0; i < pick->place.size(); ++i) out += pose_line(*pick, static_cast<int>(i) + 4, pick->place[i]);
  return out;
}

std::string TextSession::done(const std::vector<std::string>& fields) {
  if (fields.size() != 3 || !whole(fields[1]) || !whole(fields[2]))
    return say(TextStatus::wrong_fields, "wanted DONE,pick,result");
  const int result = *whole(fields[2]);
  if (result < 1 || result > 4) return say(TextStatus::out_of_range, "1 held 2 missed 3 lost 4 placed");
  const TextPick* pick = find(*whole(fields[1]));
  if (!pick) return say(TextStatus::no_such_pick);
  // A gripper was among the parts, whether it held one or not.
  if (result != 4 && options_.rescan_after_pick) changed_ = true;
  if (vision_.report) vision_.report(scene_, *pick, result);
  return say(TextStatus::noted);
}

std::string TextSession::answer(const std::string& line) {
  std::vector<std::string> fields = fields_of(line);
  std::string& name = fields.front();
  for (char& c : name) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  if (name == "HELLO") return hello(fields);
  if (name == "BYE") {
    over_ = true;
    return say(TextStatus::noted);
  }
  if (!greeted_) return say(TextStatus::hello_first);
  if (name == "GET") return get(fields);
  if (name == "PLACE") return place(fields);
  if (name == "DONE") return done(fields);
  if (name == "SCAN") return fields.size() == 1 ? scan() : say(TextStatus::wrong_fields, "wanted SCAN");
  return say(TextStatus::unknown_request, "HELLO SCAN GET PLACE DONE BYE");
}

std::string TextSession::receive(std::string_view bytes) {
  std::string out;
  for (const char byte : bytes) {
    if (over_) break;
    // Lines end at CR, LF or both: brands differ.
    if (byte != '\r' && byte != '\n') {
      buffer_ += byte;
      if (buffer_.size() <= kLongestTextLine) continue;
      over_ = true;
      buffer_.clear();
      out += say(TextStatus::line_too_long);
      break;
    }
    if (buffer_.find_first_not_of(' ') != std::string::npos) out += answer(buffer_);
    buffer_.clear();
  }
  return out;
}

}  // namespace tribin::robot
