#include "tribin/picking/rack.hpp"

#include <gtest/gtest.h>

namespace tribin::picking {
namespace {

Rack grid() {
  Rack rack;
  rack.slots = {2, 3, 2, Vec3(100, 80, 50), 40};
  rack.sequence = {"a", "b", "a", "battery"};
  return rack;
}

TEST(Rack, ColumnsThenRowsThenLayersInTheSequence) {
  const std::vector<Slot> slots = slots_of(grid());
  ASSERT_EQ(slots.size(), 12u);
  EXPECT_EQ(slots[0].base_from_slot.translation(), Vec3(0, 0, 0));
  EXPECT_EQ(slots[2].base_from_slot.translation(), Vec3(200, 0, 0));
  EXPECT_EQ(slots[3].base_from_slot.translation(), Vec3(40, 80, 0));  // every second row is shifted
  EXPECT_EQ(slots[6].base_from_slot.translation(), Vec3(0, 0, 50));
  EXPECT_EQ(slots[3].parts, std::vector<std::string>{"battery"});
  EXPECT_EQ(slots[4].parts, std::vector<std::string>{"a"});
  EXPECT_TRUE(may_stand(slots[1], "b"));
  EXPECT_FALSE(may_stand(slots[1], "a"));
  EXPECT_EQ(name_of(slots[3]), "slot 4 (battery)");
}

TEST(Rack, ARackWithoutSequenceTakesAnything) {
  Rack rack = grid();
  rack.sequence.clear();
  for (const Slot& slot : slots_of(rack)) EXPECT_TRUE(may_stand(slot, "whatever"));
}

TEST(Rack, GivenSlotsStandInPlaceOfTheGrid) {
  Rack rack = grid();
  rack.base_from_rack.translation() = Vec3(0, 700, 0);
  rack.given.resize(2);
  rack.given[1].rack_from_slot.translation() = Vec3(10, 20, 30);
  rack.given[1].parts = {"battery", "a"};
  const std::vector<Slot> slots = slots_of(rack);
  ASSERT_EQ(slots.size(), 2u);
  EXPECT_EQ(slots[1].base_from_slot.translation(), Vec3(10, 720, 30));
  EXPECT_EQ(slots[0].parts, std::vector<std::string>{"a"});
  EXPECT_TRUE(may_stand(slots[1], "battery"));
}

TEST(Rack, NextSlots) {
  const std::vector<Slot> slots = slots_of(grid());
  Filling filling(slots.size());
  filling[1] = "b";
  const auto numbers = [&](WhenMissing when) {
    std::vector<int> out;
    for (const Slot* slot : open_slots(slots, filling, when)) out.push_back(slot->number);
    return out;
  };
  EXPECT_EQ(numbers(WhenMissing::skip), (std::vector<int>{1, 3, 4, 5, 6}));  // the layer above has to wait
  EXPECT_EQ(numbers(WhenMissing::wait), std::vector<int>{1});
  for (int i = 0; i < 6; ++i) filling[i] = "x";
  EXPECT_EQ(numbers(WhenMissing::skip), (std::vector<int>{7, 8, 9, 10, 11, 12}));
  for (std::string& slot : filling) slot = "x";
  EXPECT_TRUE(numbers(WhenMissing::skip).empty());
}

TEST(Rack, TheChamferHoldsThreeSigmas) {
  const std::vector<Slot> slots = slots_of(grid());
  const PlaceError error{0.3, 0.3, 0.5, 0.5};
  EXPECT_NEAR(error.total(), 0.825, 0.001);
  EXPECT_FALSE(too_tight(slots[0], error, 3));
  EXPECT_FALSE(too_tight(slots[0], error, 0));  // the rack does not say
  const auto refused = too_tight(slots[0], error, 2);
  ASSERT_TRUE(refused);
  EXPECT_NE(refused->find("slot 1 (a): saw a chamfer of 2.00 mm, wanted at least 2.47 mm"), std::string::npos)
      << *refused;
}

}  // namespace
}  // namespace tribin::picking
