#include "tribin/io/hand_eye_file.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "capture/hand_eye_simulation.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"
#include "tribin/kinematics/rotation_conventions.hpp"

namespace tribin {
namespace {

using Json = nlohmann::json;

Json list(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

Json file_of(const test::HandEyeSimulation& cell, robot::Convention convention) {
  Json out = {{"convention", robot::name_of(convention)}, {"robot", Json::array()}, {"camera", Json::array()}};
  for (const HandEyePair& pair : cell.pairs) {
    out["robot"].push_back({{"id", pair.id}, {"pose", robot::numbers_from_pose(convention, pair.base_from_flange)}});
    const Matrix3 r = pair.camera_from_target.linear();
    Json entry = {{"id", std::stoi(pair.id)}, {"translation_mm", list(pair.camera_from_target.translation())}};
    entry["rotation_vector_rad"] = list(vector_from_rotation(r));
    out["camera"].insert(out["camera"].begin(), entry);  // another order: ids pair them
  }
  return out;
}

double difference(const Pose& a, const Pose& b) { return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff(); }

TEST(HandEyeFile, EveryConventionReadsAsTheSamePoses) {
  const test::TemporaryFolder folder;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const test::HandEyeSimulation cell = test::simulate_hand_eye(seed);
    for (robot::Convention convention : robot::kConventions) {
      SCOPED_TRACE(std::string(robot::name_of(convention)) + ", seed " + std::to_string(seed));
      const HandEyeFile file = read_hand_eye_file(folder.write("poses.json", file_of(cell, convention).dump()));
      ASSERT_EQ(file.pairs.size(), cell.pairs.size());
      for (std::size_t i = 0; i < cell.pairs.size(); ++i) {
        EXPECT_EQ(file.pairs[i].id, cell.pairs[i].id);
        EXPECT_LT(difference(file.pairs[i].base_from_flange, cell.pairs[i].base_from_flange), 1e-9);
        EXPECT_LT(difference(file.pairs[i].camera_from_target, cell.pairs[i].camera_from_target), 1e-9);
      }
    }
  }
}

TEST(HandEyeFile, TheUnitOfTheRobotIsAsked) {
  const test::TemporaryFolder folder;
  const test::HandEyeSimulation cell = test::simulate_hand_eye(1);
  Json metres = file_of(cell, robot::Convention::ur);
  for (Json& entry : metres["robot"])
    for (int k = 0; k < 3; ++k) entry["pose"][k] = entry["pose"][k].get<double>() / 1000;
  try {
    read_hand_eye_file(folder.write("poses.json", metres.dump()));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::out_of_range);
  }
  metres["robot_unit"] = "m";
  const HandEyeFile file = read_hand_eye_file(folder.write("poses.json", metres.dump()));
  EXPECT_LT(difference(file.pairs[3].base_from_flange, cell.pairs[3].base_from_flange), 1e-9);
  Json ros = file_of(cell, robot::Convention::ros);
  ros["robot_unit"] = "m";  // as it is anyway
  EXPECT_LT(difference(read_hand_eye_file(folder.write("poses.json", ros.dump())).pairs[3].base_from_flange,
                       cell.pairs[3].base_from_flange),
            1e-9);
}

TEST(HandEyeFile, BrokenFilesAreOneSentence) {
  const test::TemporaryFolder folder;
  const Json good = file_of(test::simulate_hand_eye(1), robot::Convention::abb);
  const std::vector<std::pair<std::string, std::string>> bad{{"[]", "top level"},
                                                             {"{", "line 1"},
                                                             {R"({"robot": 3, "camera": []})", "robot"},
                                                             {"{}", "\"robot\""},
                                                             {good.dump().substr(0, 300), "line 1"}};
  for (const auto& [text, words] : bad) {
    SCOPED_TRACE(text);
    try {
      read_hand_eye_file(folder.write("poses.json", text));
      FAIL();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::bad_input);
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
  }
  // Any one value replaced by nonsense is an error of its own kind or harmless, never another failure.
  const Json flat = good.flatten();
  for (const auto& [place, ignored] : flat.items()) {
    for (const Json& nonsense : {Json(nullptr), Json("x"), Json(1e300), Json(Json::array()), Json({{"a", 1}})}) {
      Json broken = good;
      broken[Json::json_pointer(place)] = nonsense;
      try {
        read_hand_eye_file(folder.write("poses.json", broken.dump()));
      } catch (const Error&) {
      }
    }
  }
}

TEST(HandEyeFile, DaysOfTheCalendar) {
  for (const char* good : {"2026-11-22", "2024-02-29", "2000-02-29", "1999-12-31"}) EXPECT_TRUE(is_date(good)) << good;
  for (const char* bad :
       {"2026-02-29", "1900-02-29", "2026-13-01", "2026-00-10", "2026-1-1", "22.11.2026", "", "2026-11-31"})
    EXPECT_FALSE(is_date(bad)) << bad;
}

}  // namespace
}  // namespace tribin
