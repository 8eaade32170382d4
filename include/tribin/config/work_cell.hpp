#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tribin/capture/hand_eye.hpp"
#include "tribin/core/geometry.hpp"
#include "tribin/scan/scan.hpp"

/// What stands where in a work cell: plain descriptions, read from TOML and checked. Millimetres and radians here; the
/// file's keys name their own units. docs/work_cell.md lists every key.
namespace tribin {

struct CellCamera {
  std::filesystem::path file;  ///< camera file (intrinsics, noise)
  CameraMount mount = CameraMount::fixed;
  double keep_out_mm = 0;   ///< radius of a ball about its optical centre that its body fills; 0 = not said
  std::vector<Pose> looks;  ///< on the flange: base_from_flange of its scans, the usual one first
};

/// Where the camera stands: on the base (fixed) or on the flange (hand).
struct CellHandEye {
  Pose parent_from_camera = Pose::Identity();  ///< base_from_camera or flange_from_camera
  double sigma_mm = 0;                         ///< of its position, 0 = not said
  double sigma_rad = 0;                        ///< of its rotation, 0 = not said
};

/// An open bin. Its frame: origin on the inner floor's middle, x along the first inner side, z up.
struct CellBin {
  Pose base_from_bin = Pose::Identity();
  Vec3 inner_size_mm = Vec3::Zero();  ///< length, width, height
  double wall_mm = 8;                 ///< of walls and floor
};

struct CellBox {
  Vec3 center_mm = Vec3::Zero();  ///< axes of the frame it is given in
  Vec3 size_mm = Vec3::Zero();
};

struct CellCylinder {
  Vec3 center_mm = Vec3::Zero();  ///< the middle of its axis
  Vec3 axis = Vec3::UnitZ();      ///< unit
  double radius_mm = 0;
  double height_mm = 0;
};

enum class GripperKind { parallel_outside, parallel_inside, three_jaw, suction, magnet };

struct Gripper {
  std::string name;
  GripperKind kind = GripperKind::parallel_outside;
  std::array<double, 2> stroke_mm{0, 0};  ///< least and largest opening; 0, 0 for suction and magnets
  double force_n = 0;                     ///< of closing, or of holding; 0 = not said
  double friction = 0.3;                  ///< of the jaws on the parts: metal on metal 0.2 to 0.3, rubber 0.5
  Vec3 finger_mm = Vec3::Zero();  ///< of each jaw: thickness (along its travel), width, length; 0 = as the boxes say
  double tip_mm = 0;              ///< how far such jaws reach beyond the TCP
  double cup_radius_mm = 0;       ///< suction and magnets
  Pose flange_from_tcp = Pose::Identity();
  std::vector<CellBox> boxes;           ///< its body, frame of the flange
  std::vector<CellCylinder> cylinders;  ///< the same
  double slip_mm = 0.3;                 ///< sd of how a part shifts while it is gripped
};

/// A place where a part is to be gripped, given by hand.
struct PickPoint {
  std::string name;
  std::string gripper;  ///< empty = any of the part's
  Pose part_from_tcp = Pose::Identity();
  double priority = 1;  ///< weight of its score, > 0
  double tilt_rad = 0;  ///< the tool may tilt by that much from it
  double roll_rad = 0;  ///< and turn about its own axis, to both sides; half a turn = as it likes
};

struct CellPart {
  std::string name;
  std::filesystem::path cad;
  std::string unit = "mm";  ///< of CAD files that name none: mm, cm, m, inch
  double mass_kg = 0;       ///< 0 = not known
  std::vector<std::string> grippers;
  bool free_spin = false;                  ///< its turn about its nearly round axis makes no difference
  double max_tilt_rad = 40 * kDegree;      ///< of the approach to the vertical
  std::vector<PickPoint> pick_points;      ///< empty = grasps are found from the part's surfaces
  Pose slot_from_part = Pose::Identity();  ///< how it stands in a slot, and at the station
  std::vector<Pose> station_from_part;     ///< other ways in which the station holds it: to turn it over
};

struct RackSlots {
  int rows = 1, columns = 1, layers = 1;
  Vec3 pitch_mm = Vec3::Zero();  ///< from column to column (x), row to row (y), layer to layer (z)
  double stagger_mm = 0;         ///< shift along x of every second row
};

/// A slot that is given by itself, outside of any grid.
struct GivenSlot {
  Pose rack_from_slot = Pose::Identity();
  std::vector<std::string> parts;  ///< that may stand in it; empty = as the sequence says
};

/// What to do while the part of the next slot is not seen.
enum class WhenMissing { skip, wait };

struct Rack {
  Pose base_from_rack = Pose::Identity();  ///< the first slot; z up
  RackSlots slots;
  std::vector<GivenSlot> given;       ///< in place of the grid, in the order of filling
  std::vector<std::string> sequence;  ///< names of parts, used in turn
  double chamfer_mm = 0;              ///< of a slot: what a place error may be
  bool check_by_scan = false;         ///< a slot is filled where the last scan shows that it is empty
  WhenMissing when_missing = WhenMissing::skip;
};

/// Where a part is put down to be gripped anew: a fixture that holds it as a slot does, with room around it.
struct Regrasp {
  Pose base_from_station = Pose::Identity();  ///< z up
};

/// Where the arm shows what it holds to a fixed camera, which then measures how it is held.
struct InHand {
  std::vector<Pose> looks;  ///< base_from_flange of each scan; one at least
};

enum class ControllerKind { nx100, hses, text };

struct CellController {
  ControllerKind kind = ControllerKind::nx100;
  std::string address = "127.0.0.1";
  int port = 80;
};

struct CellRobot {
  std::filesystem::path model;        ///< geometry file of the arm
  std::string arm;                    ///< of the model; empty = its first
  std::vector<std::string> grippers;  ///< that sit on it; empty = all
  std::optional<Pose> wait;           ///< base_from_flange where one of two arms waits, for a waist at 0
  CellController controller;
  double speed_cap_mm_s = 250;
  double sigma_mm = 0.3;         ///< sd of where it stands when it is sent somewhere
  std::vector<Pose> way_points;  ///< base_from_tcp from bin to rack; empty = up, across, down
};

/// A box along the base's axes.
struct CellRange {
  Vec3 min = Vec3::Zero();
  Vec3 max = Vec3::Zero();
};

struct Safety {
  bool allow_arm = false;                 ///< motion needs this and --arm
  std::optional<CellRange> workspace_mm;  ///< where the TCP may be; none = nowhere but in a dry run
  std::vector<CellRange> forbidden_mm;
  double scan_max_age_s = 10;  ///< of a scan that motion goes by
};

struct WorkCell {
  std::filesystem::path file;  ///< for messages; the files named in it are sought beside it
  std::optional<CellCamera> camera;
  CellHandEye hand_eye;  ///< the identity where it is left out: then base means camera
  std::optional<CellBin> bin;
  std::vector<Gripper> grippers;
  std::vector<CellPart> parts;
  std::optional<Rack> rack;
  std::optional<Regrasp> regrasp;
  std::optional<InHand> in_hand;
  std::vector<CellRobot> robots;
  Safety safety;
  std::vector<std::string> warnings;

  CameraMount mount() const { return camera ? camera->mount : CameraMount::fixed; }
};

/// Reads a work cell; it must have [camera]. What else a command needs it asks for itself. Paths are made to lead from
/// the working directory. \throws Error bad_input (file, line and column, seen, wanted) for what is no TOML, unknown
/// keys, wrong types, values out of range, equal names, and names that lead nowhere.
WorkCell read_work_cell(const std::filesystem::path& path);

/// Reads a bin: a file with [bin] alone, or a work cell. Without [hand_eye], base_from_bin is where the camera sees it.
/// \throws Error as read_work_cell; [bin] is wanted, [camera] is not.
WorkCell read_bin(const std::filesystem::path& path);

/// Where the camera was. \param base_from_flange  of the scan; needed by a camera on the flange.
/// \throws Error bad_input where it is needed and missing.
Pose base_from_camera(const WorkCell& cell, const std::optional<Pose>& base_from_flange = {});

/// The same for a scan, as its file tells it (tribin/io/taken_file.hpp). A scan of a camera on the flange is refused
/// where the pose or a time is missing (bad_input), and where the pose is older than the scan (out_of_range): the robot
/// may have moved in between.
/// \param scan    its name, for the message.
/// \param now_ms  UTC; given where motion goes by the scan: then one older than safety.scan_max_age_s, or from the
///                future, is refused (out_of_range), whatever the mount.
Pose base_from_camera(const WorkCell& cell, const Taken& taken, const std::string& scan,
                      std::optional<std::int64_t> now_ms = {});

/// The table of all keys, as docs/work_cell.md shows it: key, unit, range, default, meaning. Markdown.
std::string work_cell_keys();

}  // namespace tribin
