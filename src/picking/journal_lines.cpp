// Journal entries as JSON lines, both ways.
#include "picking/journal_lines.hpp"

#include <array>

#include "io/pose_json.hpp"

namespace tribin::picking {
namespace {

constexpr std::array kNames = {"new_rack", "pick_ordered", "picked",       "measured", "missed",    "place_ordered",
                               "placed",   "lost",         "move_ordered", "moved",    "not_taken", "operator_said"};

Entry entry_of(const io::JsonPlace& line) {
  line.must_be_object("a journal entry");
  line.only_keys({"event", "cycle", "scene", "part", "gripper", "grasp", "slot", "base_from_part", "tcp_from_part",
                  "opening_mm", "holds_mm", "sigma_mm", "from_station", "note", "arm"});
  const auto length = [&line](const char* key) {
    return line.has(key) ? line.at(key, "mm").number(0, 1e5, "a length in mm") : 0.0;
  };
  const auto text = [&line](const char* key) {
    return line.has(key) ? line.at(key, "a text").text("a text") : std::string();
  };
  const auto whole = [&line](const char* key) {
    return line.has(key) ? line.at(key, "a number").whole(0, 1 << 30, "a whole number >= 0") : 0;
  };
  Entry entry;
  const io::JsonPlace event = line.at("event", "the name of an event");
  const std::string name = event.text("the name of an event");
  const auto known = std::find(kNames.begin(), kNames.end(), name);
  if (known == kNames.end()) event.fail("an event that this version knows");
  entry.event = static_cast<Event>(known - kNames.begin());
  entry.cycle = whole("cycle"), entry.scene = whole("scene"), entry.slot = whole("slot");
  if (line.has("arm")) entry.arm = line.at("arm", "1 or 2").whole(1, 2, "1 or 2");
  entry.part = text("part"), entry.gripper = text("gripper"), entry.grasp = text("grasp"), entry.note = text("note");
  if (line.has("base_from_part")) entry.base_from_part = io::pose_of(line.at("base_from_part", "a pose"));
  if (line.has("tcp_from_part")) entry.tcp_from_part = io::pose_of(line.at("tcp_from_part", "a pose"));
  if (line.has("from_station")) {
    const io::JsonPlace from = line.at("from_station", "true or false");
    if (!from.value().is_boolean()) from.fail("true or false");
    entry.from_station = from.value().get<bool>();
  }
  entry.opening_mm = length("opening_mm"), entry.holds_mm = length("holds_mm"), entry.sigma_mm = length("sigma_mm");
  return entry;
}

}  // namespace

std::string_view name_of(Event event) { return kNames[static_cast<std::size_t>(event)]; }

std::string line_of(const Entry& entry) {
  nlohmann::ordered_json json;
  json["event"] = name_of(entry.event);
  if (entry.cycle) json["cycle"] = entry.cycle;
  if (entry.arm != 1) json["arm"] = entry.arm;
  if (entry.scene) json["scene"] = entry.scene;
  if (!entry.part.empty()) {
    json["part"] = entry.part;
    json["gripper"] = entry.gripper;
    json["grasp"] = entry.grasp;
    json["slot"] = entry.slot;
    json["opening_mm"] = entry.opening_mm;
    if (entry.holds_mm > 0) json["holds_mm"] = entry.holds_mm;
    if (entry.sigma_mm > 0) json["sigma_mm"] = entry.sigma_mm;
    if (entry.from_station) json["from_station"] = true;
    json["base_from_part"] = io::json_of(entry.base_from_part);
    json["tcp_from_part"] = io::json_of(entry.tcp_from_part);
  } else if (entry.slot) {
    json["slot"] = entry.slot;
  }
  if (!entry.note.empty()) json["note"] = entry.note;
  return json.dump();
}

std::vector<Entry> entries_of(const std::string& text, const std::string& name) {
  std::vector<Entry> entries;
  std::size_t begin = 0;
  for (int number = 1; begin < text.size(); ++number) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;  // torn
    const std::string line = text.substr(begin, end - begin), where = name + ": line " + std::to_string(number);
    begin = end + 1;
    try {
      entries.push_back(entry_of({where, nlohmann::json::parse(line), io::JsonPlace::kTop}));
    } catch (const nlohmann::json::parse_error&) {
      throw Error(ErrorCode::bad_input, where + ": saw text that is no JSON, wanted a journal entry");
    }
  }
  return entries;
}

}  // namespace tribin::picking
