#include "config/cell_fields.hpp"

#include "config/pose_fields.hpp"

namespace tribin::config {
namespace {

using io::Fields;
using io::kAboveZero;
using io::TomlPlace;

// A cell is smaller than 100 m, a thing in it than 10 m: larger numbers are mistaken units.
constexpr double kFarthest = 1e5, kLargest = 1e4;

void must_have_name(const TomlPlace& place, const std::string& name) {
  if (name.empty()) place.at("name").fail("a name");
}

/// Boxes that span lengths along the axes of the base.
Fields<CellRange> range_fields() {
  Fields<CellRange> fields;
  fields.numbers("min", "mm", {-kFarthest, kFarthest}, &CellRange::min, "lower corner, base").required();
  fields.numbers("max", "mm", {-kFarthest, kFarthest}, &CellRange::max, "upper corner, base").required();
  return fields.check([](const TomlPlace& place, const CellRange& range) {
    if (!(range.min.array() < range.max.array()).all()) place.at("max").fail("max above min on each axis");
  });
}

Fields<CellBox> box_fields() {
  Fields<CellBox> fields;
  fields.numbers("center_mm", "mm", {-kLargest, kLargest}, &CellBox::center_mm, "its middle, flange");
  return fields.numbers("size_mm", "mm", {kAboveZero, kLargest}, &CellBox::size_mm, "its sides").required();
}

Fields<CellCylinder> cylinder_fields() {
  Fields<CellCylinder> fields;
  fields.numbers("center_mm", "mm", {-kLargest, kLargest}, &CellCylinder::center_mm, "the middle of its axis, flange");
  fields.value("axis", "", "3 numbers", "[0, 0, 1]", &CellCylinder::axis, "its direction", [](const TomlPlace& p) {
    Vec3 axis;
    if (p.array_size("3 numbers") != 3) p.fail("3 numbers");
    for (std::size_t i = 0; i < 3; ++i) axis[static_cast<int>(i)] = p.at(i).number(-kLargest, kLargest, "a number");
    if (axis.norm() < 1e-6) p.fail("a direction that is not 0");
    return Vec3(axis.normalized());
  });
  fields.number("radius_mm", "mm", {kAboveZero, kLargest}, &CellCylinder::radius_mm, "its radius").required();
  return fields.number("height_mm", "mm", {kAboveZero, kLargest}, &CellCylinder::height_mm, "its length").required();
}

Fields<PickPoint> pick_point_fields() {
  Fields<PickPoint> fields;
  fields.text("name", &PickPoint::name, "for messages");
  fields.text("gripper", &PickPoint::gripper, "name of a gripper; left out: any of the part's");
  add_pose(fields, "part_from_tcp", &PickPoint::part_from_tcp, "where the TCP is when it grips");
  fields.number("priority", "", {kAboveZero, 1000}, &PickPoint::priority, "weight of its score");
  fields.number("tilt_deg", "deg", {0, 90}, &PickPoint::tilt_rad, "by which the tool may tilt from it", kDegree);
  return fields.number("roll_deg", "deg", {0, 180}, &PickPoint::roll_rad,
                       "by which it may turn about its own axis, to both sides; 180: as it likes", kDegree);
}

Fields<RackSlots> slot_fields() {
  Fields<RackSlots> fields;
  fields.whole("rows", 1, 1000, &RackSlots::rows, "along y");
  fields.whole("columns", 1, 1000, &RackSlots::columns, "along x");
  fields.whole("layers", 1, 1000, &RackSlots::layers, "along z");
  fields.numbers("pitch_mm", "mm", {-kLargest, kLargest}, &RackSlots::pitch_mm, "from slot to slot along x, y, z");
  fields.number("stagger_mm", "mm", {-kLargest, kLargest}, &RackSlots::stagger_mm, "shift of every second row along x");
  return fields.check([](const TomlPlace& place, const RackSlots& slots) {
    const int count[3] = {slots.columns, slots.rows, slots.layers};
    for (int k = 0; k < 3; ++k)
      if (count[k] > 1 && slots.pitch_mm[k] == 0)
        place.fail("a pitch_mm other than 0 along " + std::string(1, "xyz"[k]) + ", where there are several slots");
  });
}

Fields<GivenSlot> given_slot_fields() {
  Fields<GivenSlot> fields;
  add_pose(fields, "rack_from_slot", &GivenSlot::rack_from_slot, "where it is, z up");
  return fields.texts("parts", &GivenSlot::parts,
                      "names of the parts that may stand in it; none: as the sequence says");
}

std::vector<Pose> read_poses(const TomlPlace& place) {
  const std::size_t count = place.array_size("a list of poses");
  std::vector<Pose> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(read_pose(place.at(i)));
  return out;
}

std::vector<Pose> read_way_points(const TomlPlace& place) {
  constexpr const char* kWanted = "a list of at most 6 poses";  // as many as the hand-shake takes at once
  if (place.array_size(kWanted) > 6) place.fail(kWanted);
  return read_poses(place);
}

Fields<CellController> controller_fields() {
  Fields<CellController> fields;
  fields.choice("kind",
                {{"nx100", ControllerKind::nx100}, {"hses", ControllerKind::hses}, {"text", ControllerKind::text}},
                &CellController::kind, "host control over TCP, HSES over UDP, or the text protocol");
  fields.text("address", &CellController::address, "IP address or name");
  return fields.whole("port", 1, 65535, &CellController::port, "its port");
}

}  // namespace

Fields<CellCamera> camera_fields() {
  Fields<CellCamera> fields;
  fields.file("file", &CellCamera::file, "camera file: intrinsics and noise").required();
  fields.choice("mount", {{"fixed", CameraMount::fixed}, {"hand", CameraMount::hand}}, &CellCamera::mount,
                "fixed: it stands in the cell; hand: it is on the flange");
  fields.number("keep_out_mm", "mm", {0, kLargest}, &CellCamera::keep_out_mm,
                "radius of a ball about its optical centre that its body fills; 0 = not said");
  return fields.value("looks", "", "at most 6 poses", "[]", &CellCamera::looks,
                      "on the flange: where that stands in the base for a scan; the first always, the others when "
                      "nothing can be picked",
                      read_way_points);
}

Fields<HandEyeKeys> hand_eye_fields() {
  Fields<HandEyeKeys> fields;
  fields.value("base_from_camera", "", "pose with sigma", kPoseFallback, &HandEyeKeys::base_from_camera,
               "where a fixed camera stands", read_uncertain_pose);
  return fields.value("flange_from_camera", "", "pose with sigma", kPoseFallback, &HandEyeKeys::flange_from_camera,
                      "where a camera on the flange sits", read_uncertain_pose);
}

Fields<CellBin> bin_fields() {
  Fields<CellBin> fields;
  add_pose(fields, "base_from_bin", &CellBin::base_from_bin,
           "middle of the inner floor, x along the first side, z up; without [hand_eye] camera_from_bin");
  fields.numbers("inner_size_mm", "mm", {kAboveZero, kLargest}, &CellBin::inner_size_mm, "length, width, height inside")
      .required();
  return fields.number("wall_mm", "mm", {kAboveZero, 1000}, &CellBin::wall_mm, "of walls and floor");
}

Fields<Gripper> gripper_fields() {
  Fields<Gripper> fields;
  fields.text("name", &Gripper::name, "what parts call it").required();
  fields
      .choice("kind",
              {{"parallel_outside", GripperKind::parallel_outside},
               {"parallel_inside", GripperKind::parallel_inside},
               {"three_jaw", GripperKind::three_jaw},
               {"suction", GripperKind::suction},
               {"magnet", GripperKind::magnet}},
              &Gripper::kind, "how it holds")
      .required();
  fields.numbers("stroke_mm", "mm", {0, kLargest}, &Gripper::stroke_mm, "least and largest opening; jaws need it");
  fields.number("force_n", "N", {0, 1e6}, &Gripper::force_n, "of closing or holding; 0 = not said");
  fields.number("friction", "", {0.01, 2}, &Gripper::friction, "of the jaws on the parts");
  fields.numbers("finger_mm", "mm", {0, kLargest}, &Gripper::finger_mm,
                 "each jaw: thickness (along its travel), width, length; left out: see below");
  fields.number("tip_mm", "mm", {0, kLargest}, &Gripper::tip_mm, "how far such jaws reach beyond the TCP");
  fields.number("cup_radius_mm", "mm", {0, kLargest}, &Gripper::cup_radius_mm, "suction and magnets; 0 = not said");
  add_pose(fields, "flange_from_tcp", &Gripper::flange_from_tcp, "the tool's centre point");
  fields.list("boxes", box_fields(), &Gripper::boxes, "its body");
  fields.list("cylinders", cylinder_fields(), &Gripper::cylinders, "its body");
  fields.number("slip_mm", "mm", {0, 100}, &Gripper::slip_mm, "sd of how a part shifts while it is gripped");
  return fields.check([](const TomlPlace& place, const Gripper& gripper) {
    must_have_name(place, gripper.name);
    const bool jaws = gripper.kind != GripperKind::suction && gripper.kind != GripperKind::magnet;
    if (place.has("stroke_mm") && !(gripper.stroke_mm[0] <= gripper.stroke_mm[1]))
      place.at("stroke_mm").fail("the least opening first");
    if (jaws && !(gripper.stroke_mm[0] < gripper.stroke_mm[1])) place.fail("a stroke_mm above 0, as jaws have");
    if (place.has("finger_mm") && !jaws) place.at("finger_mm").fail("no finger_mm, as it has no jaws");
    if (place.has("finger_mm") && !(gripper.finger_mm.array() > 0).all())
      place.at("finger_mm").fail("3 lengths above 0: thickness, width, length");
    if (place.has("tip_mm") && !(gripper.tip_mm < gripper.finger_mm.z()))
      place.at("tip_mm").fail("less than the length in finger_mm");
  });
}

Fields<CellPart> part_fields() {
  Fields<CellPart> fields;
  fields.text("name", &CellPart::name, "its name in results").required();
  fields.file("cad", &CellPart::cad, "CAD file").required();
  fields.value("unit", "", "mm, cm, m, inch", "\"mm\"", &CellPart::unit, "of a CAD file that names none",
               [](const TomlPlace& place) {
                 constexpr const char* kWanted = "mm, cm, m or inch";
                 const std::string unit = place.text(kWanted);
                 if (unit != "mm" && unit != "cm" && unit != "m" && unit != "inch") place.fail(kWanted);
                 return unit;
               });
  fields.number("mass_kg", "kg", {0, 1000}, &CellPart::mass_kg, "0 = not known");
  fields.texts("grippers", &CellPart::grippers, "names of the grippers that may hold it");
  fields.number("max_tilt_deg", "deg", {0, 180}, &CellPart::max_tilt_rad, "of the approach to the vertical", kDegree);
  fields.flag("free_spin", &CellPart::free_spin,
              "its turn about its nearly round axis makes no difference, as of a toothed wheel");
  fields.list("pick_points", pick_point_fields(), &CellPart::pick_points,
              "where to grip; none: grasps are found from its surfaces");
  add_pose(fields, "slot_from_part", &CellPart::slot_from_part, "how it stands in a slot, and at the station");
  fields.value("station_from_part", "", "list of poses", "[]", &CellPart::station_from_part,
               "other ways in which the station holds it, on its side for one: to turn it over", read_poses);
  return fields.check([](const TomlPlace& place, const CellPart& part) { must_have_name(place, part.name); });
}

Fields<Regrasp> regrasp_fields() {
  Fields<Regrasp> fields;
  add_pose(fields, "base_from_station", &Regrasp::base_from_station,
           "where it holds a part, as a slot does; z up, and room around it");
  return fields;
}

Fields<InHand> in_hand_fields() {
  Fields<InHand> fields;
  return fields
      .value(
          "looks", "", "1 to 6 poses", "required", &InHand::looks,
          "base_from_flange where the arm shows what it holds: a scan at each; before a fixed camera, clear of the bin",
          [](const TomlPlace& place) {
            if (place.array_size("a list of 1 to 6 poses") == 0) place.fail("a list of 1 to 6 poses");
            return read_way_points(place);
          })
      .required();
}

Fields<Rack> rack_fields() {
  Fields<Rack> fields;
  add_pose(fields, "base_from_rack", &Rack::base_from_rack, "the first slot, z up");
  fields.table("slots", slot_fields(), &Rack::slots, "the grid of slots");
  fields.list("slot", given_slot_fields(), &Rack::given, "`[[rack.slot]]`, each slot by itself, in place of the grid");
  fields.texts("sequence", &Rack::sequence, "names of parts, placed in turn; none: any part");
  fields.choice("when_missing", {{"skip", WhenMissing::skip}, {"wait", WhenMissing::wait}}, &Rack::when_missing,
                "the next slot's part is not seen: fill a later slot, or wait for it");
  fields.flag("check_by_scan", &Rack::check_by_scan,
              "a slot is filled only where the last scan sees all of its room and nothing in it");
  return fields.number("chamfer_mm", "mm", {0, 1000}, &Rack::chamfer_mm, "of a slot: what a place error may be");
}

Fields<CellRobot> robot_fields() {
  Fields<CellRobot> fields;
  fields.file("model", &CellRobot::model, "geometry file of the arm").required();
  fields.text("arm", &CellRobot::arm, "of a model of several; left out: its first");
  fields.texts("grippers", &CellRobot::grippers, "that sit on this arm; left out: all");
  fields.value("wait", "", "pose", "none", &CellRobot::wait,
               "base_from_flange where one of two arms waits, out of the camera's sight and of the other's way; it "
               "turns with the waist",
               read_pose);
  fields.table("controller", controller_fields(), &CellRobot::controller, "how it is reached");
  fields.number("sigma_mm", "mm", {0, 100}, &CellRobot::sigma_mm, "sd of where it stands when it is sent somewhere");
  fields.value("way_points", "", "at most 6 poses", "[]", &CellRobot::way_points,
               "of the TCP in the base, from the bin to the rack; none: up, across and down", read_way_points);
  return fields.number("speed_cap_mm_s", "mm/s", {kAboveZero, 2000}, &CellRobot::speed_cap_mm_s,
                       "no command asks for more");
}

Fields<Safety> safety_fields() {
  Fields<Safety> fields;
  fields.flag("allow_arm", &Safety::allow_arm, "motion needs this and --arm");
  fields.table("workspace_mm", range_fields(), &Safety::workspace_mm, "where the TCP may be; none: nowhere");
  fields.list("forbidden_mm", range_fields(), &Safety::forbidden_mm, "where it may not");
  return fields.number("scan_max_age_s", "s", {kAboveZero, 86400}, &Safety::scan_max_age_s,
                       "of a scan that motion goes by");
}

}  // namespace tribin::config
