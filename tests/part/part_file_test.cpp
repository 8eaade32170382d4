#include "tribin/part/part_file.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "part/shapes.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

constexpr ContentHash kKey = {1, 2};

/// A stepped shaft: round, with planes and cylinders, self-similar the other way round.
const Part& shaft() {
  static const Part part =
      compile_part(test::turned({{10, 0}, {10, 20}, {15, 20}, {15, 40}, {9.5, 40}, {9.5, 60}}, 48));
  return part;
}

/// Puts the right checksum and size over a payload that was changed, so that the reader gets to see it.
void seal(std::string& bytes) {
  const std::uint64_t size = bytes.size() - 56;
  const ContentHash check = content_hash(std::string_view(bytes).substr(56));
  std::memcpy(bytes.data() + 32, &check, 16);
  std::memcpy(bytes.data() + 48, &size, 8);
}

std::string refusal(std::string_view bytes, const ContentHash& key = kKey) {
  try {
    part_from_bytes(bytes, key);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::bad_input);
    return error.what();
  }
  return {};
}

TEST(ContentHash, IsMurmur3) {  // of the reference program
  EXPECT_EQ(hex_of(content_hash("")), "00000000000000000000000000000000");
  EXPECT_EQ(hex_of(content_hash("The quick brown fox jumps over the lazy dog")), "e34bbc7bbc071b6c7a433ca9c49a9347");
}

TEST(PartFile, GivesBackEveryBit) {
  const std::string bytes = bytes_of_part(shaft(), kKey);
  const Part part = part_from_bytes(bytes, kKey);
  EXPECT_EQ(bytes_of_part(part, kKey), bytes);  // all fields are in it: part_fields.hpp does not compile otherwise
  EXPECT_EQ(part.mesh.triangles, shaft().mesh.triangles);
  ASSERT_EQ(part.model.primitives.size(), shaft().model.primitives.size());
  EXPECT_FALSE(part.model.primitives.empty());
  EXPECT_EQ(part.model.primitives[0].covariance, shaft().model.primitives[0].covariance);
  EXPECT_EQ(part.symmetry.continuous.size(), shaft().symmetry.continuous.size());
  ASSERT_EQ(part.views.size(), shaft().views.size());
  EXPECT_EQ(part.views[80].points, shaft().views[80].points);
  EXPECT_EQ(part.diameter_mm, shaft().diameter_mm);
}

TEST(PartFile, KeepsEveryTypeOfPrimitive) {
  Part part = shaft();
  for (const PrimitiveType type : {PrimitiveType::plane, PrimitiveType::cylinder, PrimitiveType::cone,
                                   PrimitiveType::sphere, PrimitiveType::torus}) {
    part.model.primitives[0].type = type;
    EXPECT_EQ(part_from_bytes(bytes_of_part(part, kKey), kKey).model.primitives[0].type, type) << name_of(type);
  }
}

TEST(PartFile, RefusesWhatIsNotItself) {
  const std::string whole = bytes_of_part(shaft(), kKey);
  EXPECT_NE(refusal(whole, {1, 3}).find("key"), std::string::npos);
  EXPECT_NE(refusal("").find("tribpart"), std::string::npos);
  std::string other = whole;
  other[8] = 99;
  EXPECT_NE(refusal(other).find("version 99"), std::string::npos);
  for (std::size_t size : {7, 8, 40, 55, 56, 57, 1000}) EXPECT_NE(refusal(whole.substr(0, size)), "") << size;
  EXPECT_NE(refusal(whole.substr(0, whole.size() - 1)), "");
  EXPECT_NE(refusal(whole + "x"), "");
  for (std::size_t at = 0; at < whole.size(); at += at < 56 ? 1 : whole.size() / 200) {
    if (at >= 12 && at < 16) continue;  // not used yet
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 0x10);
    EXPECT_NE(refusal(flipped), "") << "byte " << at;
  }
}

TEST(PartFile, SealedNonsenseIsReadOrRefusedWithinItsMemory) {
  const std::string whole = bytes_of_part(compile_part(test::box(30, 20, 10)), kKey);
  std::mt19937 random(7);
  int refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::string bytes = whole;
    for (int i = 0; i < 4; ++i)
      bytes[56 + random() % std::min<std::size_t>(bytes.size() - 56, 6000)] = static_cast<char>(random());
    if (trial % 3 == 0) bytes.resize(56 + random() % (bytes.size() - 56));
    seal(bytes);
    refused += !refusal(bytes).empty();
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace tribin
