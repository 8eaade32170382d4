// Parts in the hand: the way to where the camera sees them, and how sure they are held.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "picking/chooser.hpp"

namespace tribin::picking {
namespace {

constexpr double kShowGap_mm = 20;  // to bin and rack, where nothing is to be touched

/// The bin, full to its rim: what lies in it may have moved since the last scan.
grasp::Convex full(const CellBin& bin) {
  Pose middle = bin.base_from_bin;
  const Vec3 wall(2 * bin.wall_mm, 2 * bin.wall_mm, bin.wall_mm);
  middle.translation() = bin.base_from_bin * Vec3(0, 0, (bin.inner_size_mm.z() - bin.wall_mm) / 2);
  return grasp::make_box(middle, bin.inner_size_mm + wall);
}

}  // namespace

std::optional<std::vector<Stop>> Chooser::way_to_show(const Start& start, const Pose& base_from_flange,
                                                      const Entry& held, const Filling& filling) const {
  const grasp::GripperShape& gripper = shape(held.gripper);
  auto stops = whole_way(start, base_from_flange * gripper.gripper.flange_from_tcp, held.gripper, &held);
  if (!stops) return {};
  std::vector<grasp::Convex> others;
  if (cell_.bin) others.push_back(full(*cell_.bin));
  for (const Standing& part : standing(filling)) others.push_back(box_of(*part.part, part.base_from_part));
  std::vector<grasp::Convex> carried = grasp::pieces_at(gripper, held.opening_mm);
  carried.push_back(box_of(vision_.model(held.part), held.tcp_from_part));
  // Before its last piece the way is as high as all ways are.
  const Pose to = stops->back().base_from_tcp;
  const Vec3 down = stops->size() > 1 ? Vec3((*stops)[stops->size() - 2].base_from_tcp.translation() - to.translation())
                                      : Vec3(Vec3::Zero());
  for (const grasp::Convex& piece : carried) {
    grasp::Convex body = grasp::moved(to, piece);
    body.sweep_mm = down;
    for (const grasp::Convex& other : others)
      if (grasp::distance_mm(body, other, kShowGap_mm) < kShowGap_mm) return {};
  }
  return stops;
}

Grip Chooser::grip_of(const std::string& gripper, const Pose& base_from_tcp, const Pose& tcp_from_part,
                      const Matrix6& covariance, bool from_station) const {
  return {&shape(gripper).gripper, base_from_tcp, tcp_from_part, covariance, !from_station};
}

HeldPose Chooser::held(const Grip& grip, const std::string& part, std::span<const HandLook> looks,
                       bool believe_grip) const {
  return held_pose(grip, looks, cell_.hand_eye, cell_.hand_eye.parent_from_camera.translation(),
                   vision_.model(part).box_center(), cell_.robots.front().sigma_mm, believe_grip);
}

PlaceError Chooser::error_of(const Choice& choice) const {
  PlaceError error;
  error.robot = cell_.robots.front().sigma_mm;  // one controller, one accuracy
  const grasp::Grasp& grasp = choice.grasp;
  const Gripper& gripper = shape(grasp.gripper).gripper;
  if (cell_.in_hand) {  // what will be measured is as sure as what was
    HandLook look;
    look.base_from_tcp = cell_.in_hand->looks.front() * gripper.flange_from_tcp;
    look.base_from_part = look.base_from_tcp * grasp.part_from_tcp.inverse();
    look.covariance = choice.part.covariance;
    error.pose = held(grip_of(grasp.gripper, grasp.at(grasp::Step::pick)->base_from_tcp, grasp.part_from_tcp.inverse(),
                              choice.part.covariance, false),
                      grasp.part_name, std::span(&look, 1))
                     .sigma_mm();
    return error;
  }
  const Matrix3 position = choice.part.covariance.topLeftCorner<3, 3>();
  error.pose = std::sqrt(std::max(
      0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(Eigen::Matrix3d(position)).eigenvalues().maxCoeff()));
  error.hand_eye = cell_.hand_eye.sigma_mm;
  error.grip = gripper.slip_mm;
  return error;
}

}  // namespace tribin::picking
