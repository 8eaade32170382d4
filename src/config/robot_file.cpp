#include "tribin/config/robot_file.hpp"

#include "config/pose_fields.hpp"

namespace tribin {
namespace {

using config::add_pose;
using io::Fields;
using io::kAboveZero;
using io::TomlPlace;
using robot::Arm;
using robot::ArmKind;
using robot::JointRange;
using robot::LinkCapsule;
using robot::OrthoParallel;
using robot::ShoulderElbowWrist;

constexpr double kLongest = 1e4;     // mm: 10 m, beyond any arm, so that a mistaken unit is seen
constexpr double kMostTurns = 3600;  // deg

/// What stands in a file in place of numbers that nobody but the integrator knows.
constexpr std::string_view kToFill = "fill in";

struct RangeKeys {
  std::string name;
  std::array<double, 2> limit{-kPi / kDegree, kPi / kDegree};
  double speed = 0, sign = 1, offset = 0, pulses = 0;
};

Fields<RangeKeys> joint_fields() {
  Fields<RangeKeys> fields;
  fields.text("name", &RangeKeys::name, "as the pendant shows it: S, L, ...").required();
  fields.numbers("limit_deg", "deg", {-kMostTurns, kMostTurns}, &RangeKeys::limit, "least and greatest angle")
      .required();
  fields.number("speed_deg_s", "deg/s", {kAboveZero, 10000}, &RangeKeys::speed, "greatest speed").required();
  fields.number("sign", "", {-1, 1}, &RangeKeys::sign, "1 or -1: shown angle = sign (chain + offset)");
  fields.number("offset_deg", "deg", {-360, 360}, &RangeKeys::offset, "of the chain's zero");
  fields.number("pulses_per_deg", "", {-1e7, 1e7}, &RangeKeys::pulses, "of the encoder; 0 = not said");
  return fields.check([](const TomlPlace& place, const RangeKeys& keys) {
    if (keys.limit[0] >= keys.limit[1]) place.at("limit_deg").fail("the least angle first, then the greatest");
    if (keys.sign != 1 && keys.sign != -1) place.at("sign").fail("1 or -1");
  });
}

JointRange read_joint(const TomlPlace& place) {
  const RangeKeys k = joint_fields().read(place);
  return {k.name, k.limit[0] * kDegree, k.limit[1] * kDegree, k.speed * kDegree, k.sign, k.offset * kDegree, k.pulses};
}

std::vector<JointRange> read_joints(const TomlPlace& place) {
  std::vector<JointRange> joints;
  for (std::size_t i = 0, n = place.array_size("a list of joints, from base to tool"); i < n; ++i)
    joints.push_back(read_joint(place.at(i)));
  return joints;
}

Fields<OrthoParallel> six_fields() {
  Fields<OrthoParallel> fields;
  const io::NumberRange any{-kLongest, kLongest}, positive{kAboveZero, kLongest};
  fields.number("a1", "mm", any, &OrthoParallel::a1, "first axis to the second, forward");
  fields.number("a2", "mm", any, &OrthoParallel::a2, "elbow to the wrist's axis; below 0 where the wrist lies higher");
  fields.number("b", "mm", any, &OrthoParallel::b, "sideways");
  fields.number("c1", "mm", any, &OrthoParallel::c1, "foot to the second axis, up").required();
  fields.number("c2", "mm", positive, &OrthoParallel::c2, "second to third axis").required();
  fields.number("c3", "mm", positive, &OrthoParallel::c3, "third axis to wrist").required();
  return fields.number("c4", "mm", {0, kLongest}, &OrthoParallel::c4, "wrist to flange").required();
}

Fields<ShoulderElbowWrist> seven_fields() {
  Fields<ShoulderElbowWrist> fields;
  fields.number("upper", "mm", {kAboveZero, kLongest}, &ShoulderElbowWrist::upper, "shoulder to elbow").required();
  fields.number("fore", "mm", {kAboveZero, kLongest}, &ShoulderElbowWrist::fore, "elbow to wrist").required();
  return fields.number("wrist", "mm", {0, kLongest}, &ShoulderElbowWrist::wrist, "wrist to flange").required();
}

Fields<LinkCapsule> capsule_fields() {
  Fields<LinkCapsule> fields;
  fields.whole("link", 0, robot::kMaxJoints, &LinkCapsule::link, "after which joint; 0 = the unmoved foot");
  fields.numbers("from_mm", "mm", {-kLongest, kLongest}, &LinkCapsule::from, "one end, in the frame after that joint");
  fields.numbers("to_mm", "mm", {-kLongest, kLongest}, &LinkCapsule::to, "the other end");
  return fields.number("radius_mm", "mm", {kAboveZero, kLongest}, &LinkCapsule::radius, "its radius").required();
}

Fields<Arm> arm_fields() {
  Fields<Arm> fields;
  fields.text("name", &Arm::name, "R1, R2, ...").required();
  fields
      .choice("kind", {{"spherical_wrist_6", ArmKind::spherical_wrist_6}, {"srs_7", ArmKind::srs_7}}, &Arm::kind,
              "six axes whose last three meet, or seven of shoulder, elbow and wrist")
      .required();
  fields.table("six", six_fields(), &Arm::six, "lengths of an arm of six axes");
  fields.table("seven", seven_fields(), &Arm::seven, "lengths of an arm of seven");
  fields
      .value("joints", "", "list of tables", "", &Arm::joints, "from base to tool: S L U R B T or S L E U R B T",
             read_joints)
      .required();
  add_pose(fields, "mount_from_arm", &Arm::mount_from_arm,
           "the arm's frame (six: its foot, seven: its shoulder; z along the first axis) on the waist or the base");
  fields.numbers("elbow_side", "", {-1, 1}, &Arm::elbow_side,
                 "direction in the arm's frame in which the elbow is best kept; 0, 0, 0: anywhere");
  fields.list("capsules", capsule_fields(), &Arm::capsules, "its hull");
  return fields.check([](const TomlPlace& place, const Arm& arm) {
    const bool seven = arm.kind == ArmKind::srs_7;
    if (place.has(seven ? "six" : "seven") || !place.has(seven ? "seven" : "six"))
      place.fail(seven ? "the lengths of kind srs_7 in [arm.seven], and no [arm.six]"
                       : "the lengths of kind spherical_wrist_6 in [arm.six], and no [arm.seven]");
    if (static_cast<int>(arm.joints.size()) != arm.axes())
      place.at("joints").fail(std::to_string(arm.axes()) + " joints");
    for (std::size_t i = 0; i < arm.capsules.size(); ++i)
      if (arm.capsules[i].link > arm.axes())
        place.at("capsules").at(i).at("link").fail("a link of 0 .. " + std::to_string(arm.axes()));
  });
}

struct WaistKeys {
  Pose base_from_waist = Pose::Identity();
  JointRange range;
};

Fields<WaistKeys> waist_fields() {
  Fields<WaistKeys> fields;
  add_pose(fields, "base_from_waist", &WaistKeys::base_from_waist, "its frame at 0; it turns about z");
  return fields.value("joint", "", "table", "", &WaistKeys::range, "its range", read_joint).required();
}

robot::Waist read_waist(const TomlPlace& place) {
  const WaistKeys keys = waist_fields().read(place);
  return {keys.base_from_waist, keys.range};
}

Fields<robot::RobotModel> robot_fields() {
  Fields<robot::RobotModel> fields;
  fields.text("name", &robot::RobotModel::name, "of the robot").required();
  fields.text("source", &robot::RobotModel::source, "where the numbers come from").required();
  fields.texts("assumed", &robot::RobotModel::assumed, "what in the file is not its maker's word");
  fields.value("waist", "", "table", "", &robot::RobotModel::waist, "of a dual-arm robot, carries all its arms",
               read_waist);
  return fields.list("arm", arm_fields(), &robot::RobotModel::arms, "its arms")
      .required()
      .check([](const TomlPlace& place, const robot::RobotModel& robot) {
        if (robot.arms.empty()) place.fail("at least one [[arm]]");
        for (std::size_t i = 0; i < robot.arms.size(); ++i)
          for (std::size_t k = 0; k < i; ++k)
            if (robot.arms[i].name == robot.arms[k].name)
              place.at("arm").at(i).at("name").fail("a name that no other arm has");
      });
}

/// Finds what is still to be filled in before anything else is complained about.
void refuse_unfilled(const TomlPlace& place) {
  if (const auto* table = place.node().as_table()) {
    for (const auto& [key, node] : *table) refuse_unfilled(place.at(key.str()));
  } else if (const auto* array = place.node().as_array()) {
    for (std::size_t i = 0; i < array->size(); ++i) refuse_unfilled(place.at(i));
  } else if (const auto text = place.node().value<std::string>(); text && *text == kToFill) {
    place.fail("a number: this file is to be filled in from the robot's own papers before it can be used");
  }
}

}  // namespace

robot::RobotModel read_robot(const std::filesystem::path& path) {
  const io::FileBytes file = io::read_file(path);
  const toml::table document = io::parse_toml(file);
  const TomlPlace place(file.name, document, "");
  refuse_unfilled(place);
  robot::RobotModel robot = robot_fields().read(place);
  for (Arm& arm : robot.arms)
    if (!arm.elbow_side.isZero()) arm.elbow_side.normalize();
  return robot;
}

std::string robot_keys() {
  std::vector<io::KeyRow> rows = robot_fields().rows();
  for (const io::KeyRow& row : joint_fields().rows("arm[].joints[].")) rows.push_back(row);
  for (const io::KeyRow& row : waist_fields().rows("waist.")) rows.push_back(row);
  return io::markdown_of(rows);
}

}  // namespace tribin
