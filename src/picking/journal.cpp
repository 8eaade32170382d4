#include "tribin/picking/journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "picking/journal_lines.hpp"
#include "tribin/core/error.hpp"

namespace tribin::picking {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& what) {
  throw Error(ErrorCode::device, file.string() + ": " + what);
}

[[noreturn]] void cannot_follow(const std::string& where, const Entry& entry, const std::string& saw) {
  throw Error(ErrorCode::bad_input,
              where + ": saw " + std::string(name_of(entry.event)) + " " + saw + "; wanted the journal of this rack");
}

/// The name of a new file is on the disk only when its folder is.
void sync_folder(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const int handle = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle < 0) return;
  ::fsync(handle);
  ::close(handle);
}

std::string read_all(int handle, const std::filesystem::path& file) {
  std::string text;
  char buffer[65536];
  while (true) {
    const ssize_t got = ::read(handle, buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(file, std::string("cannot be read: ") + std::strerror(errno));
    if (got == 0) return text;
    text.append(buffer, static_cast<std::size_t>(got));
  }
}

}  // namespace

void follow(JournalState& state, const Entry& entry, const std::string& where) {
  const auto slot_of = [&](int slot) -> std::string& {
    if (slot < 1 || slot > static_cast<int>(state.filling.size()))
      cannot_follow(where, entry,
                    "in slot " + std::to_string(slot) + " of " + std::to_string(state.filling.size()) + " slots");
    return state.filling[static_cast<std::size_t>(slot) - 1];
  };
  const auto must_be_empty = [&](int slot) {
    if (slot && !slot_of(slot).empty())
      cannot_follow(where, entry, "in slot " + std::to_string(slot) + ", where " + slot_of(slot) + " stands");
  };
  HandState& hand = state.hand(entry.arm);
  if (entry.cycle) hand.last_cycle = entry.cycle;
  state.last_scene = std::max(state.last_scene, entry.scene);
  const bool ended = entry.event == Event::picked || entry.event == Event::missed || entry.event == Event::placed ||
                     entry.event == Event::lost || entry.event == Event::moved;
  if (ended && entry.cycle) hand.last_taken = entry.cycle;
  switch (entry.event) {
    case Event::new_rack:
      state.filling.assign(state.filling.size(), {});
      state.placed = 0;
      break;
    case Event::pick_ordered:
    case Event::move_ordered:
      hand.open = entry;
      break;
    case Event::place_ordered:
      must_be_empty(entry.slot);
      hand.open = entry;
      break;
    case Event::picked:
      hand.open.reset();
      if (entry.from_station) state.at_station.reset();
      hand.in_hand = entry;
      break;
    case Event::measured:
      if (!hand.in_hand) cannot_follow(where, entry, "where no part is in the hand");
      hand.in_hand = entry;
      break;
    case Event::missed:
    case Event::moved:
    case Event::not_taken:
      hand.open.reset();
      break;
    case Event::placed:
      must_be_empty(entry.slot);
      hand.open.reset();
      hand.in_hand.reset();
      if (entry.slot) {
        slot_of(entry.slot) = entry.part;
        ++state.placed;
      } else {
        state.at_station = entry;
      }
      break;
    case Event::lost:
      hand.open.reset();
      hand.in_hand.reset();
      break;
    case Event::operator_said:
      // A part in the slot, or none; the hand is empty either way: the operator has seen to it.
      hand.open.reset();
      hand.in_hand.reset();
      state.at_station.reset();
      if (entry.slot) {
        state.placed += static_cast<int>(!entry.part.empty()) - static_cast<int>(!slot_of(entry.slot).empty());
        slot_of(entry.slot) = entry.part;
      }
      break;
  }
}

struct Journal::State {
  std::filesystem::path file;
  int handle = -1;
  JournalState now;
};

Journal::Journal(std::filesystem::path file, std::size_t slots) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.file = std::move(file);
  s.now.filling.resize(slots);
  const bool fresh = !std::filesystem::exists(s.file);
  s.handle = ::open(s.file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (s.handle < 0) fail(s.file, std::string("cannot be opened: ") + std::strerror(errno));
  try {
    if (::flock(s.handle, LOCK_EX | LOCK_NB) != 0) fail(s.file, "another program picks by this journal");
    if (fresh) sync_folder(s.file);
    const std::string text = read_all(s.handle, s.file);
    int line = 0;
    for (const Entry& entry : entries_of(text, s.file.string()))
      follow(s.now, entry, s.file.string() + ": line " + std::to_string(++line));
    const std::size_t whole = text.empty() ? 0 : text.rfind('\n') + 1;  // npos + 1 = 0
    if (whole != text.size() && (::ftruncate(s.handle, static_cast<off_t>(whole)) != 0 || ::fsync(s.handle) != 0))
      fail(s.file, std::string("its torn last line cannot be cut off: ") + std::strerror(errno));
  } catch (...) {
    ::close(s.handle);
    throw;
  }
}

Journal::~Journal() { ::close(state_->handle); }

const JournalState& Journal::state() const { return state_->now; }
const std::filesystem::path& Journal::file() const { return state_->file; }

void Journal::write(const Entry& entry) {
  State& s = *state_;
  JournalState next = s.now;
  follow(next, entry, s.file.string());
  const std::string line = line_of(entry) + "\n";
  std::size_t done = 0;
  while (done < line.size()) {
    const ssize_t wrote = ::write(s.handle, line.data() + done, line.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) fail(s.file, std::string("cannot be written: ") + std::strerror(errno));
    done += static_cast<std::size_t>(wrote);
  }
  if (::fsync(s.handle) != 0) fail(s.file, std::string("does not get to the disk: ") + std::strerror(errno));
  s.now = std::move(next);
}

}  // namespace tribin::picking
