#include "tribin/picking/journal.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"

namespace tribin::picking {
namespace {

Entry entry(Event event, int cycle, int slot = 0, const std::string& part = {}) {
  Entry e;
  e.event = event;
  e.cycle = cycle, e.slot = slot, e.part = part;
  e.scene = 3;
  e.base_from_part.translation() = Vec3(600.125, -3, 41);
  e.base_from_part.linear() = rotation_from_vector(Vec3(0.3, -1, 0.2));
  e.gripper = "jaw", e.grasp = "cylinder 3 radial";
  return e;
}

/// One part from bin to slot.
std::vector<Entry> whole_cycle(int cycle, int slot) {
  return {entry(Event::pick_ordered, cycle, slot, "a"), entry(Event::picked, cycle, slot, "a"),
          entry(Event::place_ordered, cycle + 1, slot, "a"), entry(Event::placed, cycle + 1, slot, "a")};
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

TEST(Journal, GoesOnWhereItWas) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "rack.ndjson";
  for (int i = 0; i < 3; ++i) {
    Journal journal(file, 4);
    EXPECT_EQ(journal.state().placed, i);
    for (const Entry& e : whole_cycle(2 * i + 1, i + 1)) journal.write(e);
  }
  const Journal journal(file, 4);
  EXPECT_EQ(journal.state().filling, (Filling{"a", "a", "a", ""}));
  EXPECT_EQ(journal.state().last_cycle, 6);
  EXPECT_EQ(journal.state().last_scene, 3);
  EXPECT_FALSE(journal.state().open || journal.state().in_hand);
}

TEST(Journal, EveryEntryComesBackAsItWas) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "rack.ndjson";
  {
    Journal journal(file, 4);
    journal.write(entry(Event::pick_ordered, 7, 2, "a"));
  }
  const Journal journal(file, 4);
  ASSERT_TRUE(journal.state().open);
  const Entry& back = *journal.state().open;
  const Entry put = entry(Event::pick_ordered, 7, 2, "a");
  EXPECT_EQ(back.event, put.event);
  EXPECT_EQ(back.slot, 2);
  EXPECT_EQ(back.grasp, put.grasp);
  EXPECT_LT((back.base_from_part.matrix() - put.base_from_part.matrix()).norm(), 1e-6);
}

// Cut after any byte, it tells what the whole lines tell, and can be written on.
TEST(Journal, ATornLineIsCutOff) {
  const test::TemporaryFolder folder;
  const auto whole = folder.path() / "whole.ndjson";
  {
    Journal journal(whole, 2);
    for (const Entry& e : whole_cycle(1, 1)) journal.write(e);
  }
  const std::string text = text_of(whole);
  for (std::size_t cut = 0; cut <= text.size(); cut += 7) {
    SCOPED_TRACE(cut);
    const auto file = folder.write("torn.ndjson", text.substr(0, cut));
    const auto lines = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(cut), '\n');
    Journal journal(file, 2);
    EXPECT_EQ(journal.state().placed, lines == 4);
    EXPECT_EQ(journal.state().open.has_value(), lines == 1 || lines == 3);
    EXPECT_EQ(journal.state().in_hand.has_value(), lines == 2 || lines == 3);
    journal.write(entry(Event::moved, 9));
    const std::string now = text_of(file);
    EXPECT_EQ(std::count(now.begin(), now.end(), '\n'), lines + 1);
  }
}

TEST(Journal, RefusesWhatItCannotFollow) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "rack.ndjson";
  Journal journal(file, 2);
  for (const Entry& e : whole_cycle(1, 1)) journal.write(e);
  EXPECT_THROW(journal.write(entry(Event::place_ordered, 3, 1, "a")), Error);  // never twice
  EXPECT_THROW(journal.write(entry(Event::place_ordered, 3, 5, "a")), Error);
  EXPECT_EQ(entries_of(text_of(file), "j").size(), 4u);  // nothing of it is on the disk
  EXPECT_THROW(Journal(file, 2), Error);                 // one program at a time
  EXPECT_THROW(entries_of("{\"event\": \"danced\"}\n", "j"), Error);
  EXPECT_THROW(entries_of("{\"event\": \"moved\", \"slott\": 1}\n", "j"), Error);
  try {
    entries_of("{\"event\": \"moved\"}\nno json\n", "rack.ndjson");
    FAIL();
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "rack.ndjson: line 2: saw text that is no JSON, wanted a journal entry");
  }
}

TEST(Journal, TheOperatorsWordEndsTheDoubt) {
  const test::TemporaryFolder folder;
  Journal journal(folder.path() / "rack.ndjson", 2);
  journal.write(entry(Event::pick_ordered, 1, 1, "a"));
  journal.write(entry(Event::picked, 1, 1, "a"));
  journal.write(entry(Event::place_ordered, 2, 1, "a"));
  journal.write(entry(Event::operator_said, 0, 1, "a"));
  EXPECT_EQ(journal.state().filling[0], "a");
  EXPECT_EQ(journal.state().placed, 1);
  EXPECT_FALSE(journal.state().open || journal.state().in_hand);
  journal.write(entry(Event::operator_said, 0, 1));
  EXPECT_EQ(journal.state().filling[0], "");
  EXPECT_EQ(journal.state().placed, 0);
  journal.write(entry(Event::new_rack, 0));
  EXPECT_EQ(journal.state().last_cycle, 2);  // the controller still knows it
}

}  // namespace
}  // namespace tribin::picking
