#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tribin/camera/camera.hpp"
#include "tribin/config/work_cell.hpp"
#include "tribin/grasp/grasp.hpp"
#include "tribin/grasp/gripper_shape.hpp"
#include "tribin/kinematics/arm.hpp"
#include "tribin/picking/in_hand.hpp"

/// What the cycle asks of camera, recognition and grasp planning.
namespace tribin::picking {

/// Where a part of a class may be put, any of the poses will do.
using Places = std::map<std::string, std::vector<Pose>>;

/// base_from_flange, now.
using FlangePose = std::function<Pose()>;

/// What one scan shows.
struct Sight {
  std::string status;               ///< of the finder: ok, empty, not_empty_no_object, no_data, time_limit
  std::map<std::string, int> seen;  ///< parts of each class whose pose is sure
  double find_ms = 0;               ///< normals to poses, of this machine
  double age_s = 0;                 ///< of the scan, when it was taken in
  std::string suspect;  ///< why the calibration is not to be trusted: the bin is not where it should be; empty = it is
  std::vector<std::string> warnings;
};

/// For which of two arms grasps are planned.
struct ArmAtWork {
  std::size_t robot = 0;              ///< index into WorkCell::robots
  double waist = 0;                   ///< [rad]
  std::vector<grasp::Convex> others;  ///< where the other arm is, or may be meanwhile; base frame
};

/// What a scan shows of a room where nothing should be.
enum class RoomSeen {
  empty,
  occupied,
  hidden,  ///< not all of it is seen: out of view, in a shadow, behind something
};
/// \param base_from_box   the room: a box about its frame's origin, axes along it
/// \param sigma_mm        of where the camera stands: what is nearer to the room's sides than three of it, and three of
///                        the scan's noise, is not told from what stands beside
RoomSeen look_into(const Scan& scan, const Pose& base_from_camera, const Pose& base_from_box, const Vec3& size_mm,
                   double sigma_mm);

/// A part in the hand, shown to the camera.
struct HandView {
  const grasp::GripperShape* gripper = nullptr;
  double opening_mm = 0;  ///< of the jaws as they hold it
  Pose base_from_tcp = Pose::Identity();
  Pose tcp_from_part = Pose::Identity();  ///< as the grip implies
};
/// What a scan says of it.
struct HandSight {
  enum class State {
    measured,   ///< near where the grip has it
    otherwise,  ///< sure, and in another pose than the grip implies: found upside down, or slipped far
    unsure,     ///< too little is seen, or nothing tells: `why`
    gone,       ///< it is not in the gripper
  };
  State state = State::unsure;
  HandLook look;  ///< where it is measured or otherwise
  std::string why;
};
/// Measures a part in the hand: pixels near the gripper as drawn count for nothing, and the part's symmetries are taken
/// nearest to the grip.
HandSight look_at_hand(const Scan& scan, const Pose& base_from_camera, const Part& part, const HandView& view);

class Vision {
 public:
  virtual ~Vision() = default;
  /// Plans are for that arm from now on. Without it they are for the first.
  virtual void plan_for(const ArmAtWork& arm) { (void)arm; }
  /// Takes a scan and finds the parts in it.
  /// \param flange  where the flange stands, asked when the scan is taken; none for a camera that is not on it
  virtual Sight scan(const FlangePose& flange) = 0;
  /// The last scan. \return null before the first one, and where there is no camera
  virtual const Scan* last_scan() const { return nullptr; }
  /// Of the last scan; see look_into above.
  virtual RoomSeen room(const Pose& base_from_box, const Vec3& size_mm) const {
    (void)base_from_box, (void)size_mm;
    return RoomSeen::hidden;
  }
  /// Takes a scan of a part in the hand and measures it; the last scan stays as it is.
  virtual HandSight look_at_hand(const std::string& part, const HandView& view) {
    (void)part, (void)view;
    HandSight sight;
    sight.why = "there is no camera";
    return sight;
  }
  /// Grasps for what the last scan showed. May be asked again with other options.
  virtual grasp::Plan plan(const grasp::PlanOptions& options, const Places& places) = 0;
  virtual grasp::PushPlan plan_pushes(const grasp::PlanOptions& options) = 0;
  /// Grasps for a part that stands where it was put, with nothing around it.
  virtual grasp::Plan plan_standing(const std::string& part, const Pose& base_from_part,
                                    const grasp::PlanOptions& options, const Places& places) = 0;
  /// A part of the last scan. \param index  Grasp::part
  virtual grasp::PartHere part(int index) const = 0;
  /// Of a class. \throws Error bad_input where it has none of that name
  virtual const Part& model(const std::string& name) const = 0;
};

/// Vision by a camera. \param parts  compiled, with the names of the cell's parts
/// All must outlive it.
struct VisionParts {
  const WorkCell* cell = nullptr;
  const std::vector<Part>* parts = nullptr;
  Camera* camera = nullptr;
  const robot::RobotModel* robot = nullptr;  ///< none: reach is not checked
  std::optional<Rig> rig = {};               ///< of a camera that gives frames
  bool any_age = false;                      ///< recorded scans, for trials
};
/// \throws Error bad_input where a gripper cannot be used, or the cell lacks what is needed
std::unique_ptr<Vision> open_vision(const VisionParts& from);

/// The arm that an entry of `[[robot]]` drives. \throws Error bad_input
const robot::Arm& arm_of(const WorkCell& cell, const robot::RobotModel& robot, std::size_t number = 0);

/// All poses in which a part looks as it does in this one: its symmetries, turns about an axis in steps of 15 deg.
std::vector<Pose> alike(const Part& part, const Pose& pose);

}  // namespace tribin::picking
