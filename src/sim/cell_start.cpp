// How a simulated cell begins: its heap, and its grippers as bodies.
#include <algorithm>
#include <cmath>

#include "sim/cell_world.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/error.hpp"

namespace tribin::sim {

Mesh mesh_of(const grasp::Convex& body) {
  const bool round = body.disc_mm > 0;
  const double radius = body.disc_mm + body.radius_mm;
  const Vec3 half = body.half_mm + Vec3::Constant(body.radius_mm);
  const int corners = round ? 48 : 4;
  Mesh mesh;
  for (const double z : {-half.z(), half.z()})
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * kPi * i / corners;
      const Vec3 p = round ? Vec3(radius * std::cos(angle), radius * std::sin(angle), z)
                           : Vec3(i == 0 || i == 3 ? -half.x() : half.x(), i < 2 ? -half.y() : half.y(), z);
      mesh.vertices.push_back((body.frame_from_body * p).cast<float>());
    }
  const auto n = static_cast<std::uint32_t>(corners);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t k = (i + 1) % n;
    mesh.triangles.push_back({i, k, n + k});
    mesh.triangles.push_back({i, n + k, n + i});
    if (i == 0 || k == 0) continue;
    mesh.triangles.push_back({0, k, i});
    mesh.triangles.push_back({n, n + i, n + k});
  }
  return mesh;
}

void CellWorld::drop_parts(const SimulatedCellOptions& options) {
  const Bin bin{cell_.bin->inner_size_mm.x(), cell_.bin->inner_size_mm.y(), cell_.bin->inner_size_mm.z(),
                cell_.bin->wall_mm};
  const int classes = static_cast<int>(stock_.solids.size());
  for (int i = 0; i < options.parts; ++i) class_of_.push_back(i % classes);
  for (int i = options.parts - 1; i > 0; --i) std::swap(class_of_[i], class_of_[random_.integer(0, i)]);
  const int leaning = options.at_walls ? std::max(1, options.parts / 4) : 0;
  std::vector<const Solid*> solids;
  BinFill fill;
  for (std::uint64_t attempt = 0;; ++attempt) {
    solids.clear();
    for (const int k : class_of_) solids.push_back(&stock_.solids[k]);
    const std::vector<const Solid*> dropped(solids.begin(), solids.end() - std::min<int>(leaning, class_of_.size()));
    fill = fill_bin(dropped, bin.length_mm, bin.width_mm, mixed(options.seed) + attempt);
    // A heap that leans over the rim would fall out: another one, then a smaller one.
    if (fill.wall_contact_mm <= bin.height_mm) break;
    if (attempt % 3 == 2) class_of_.pop_back();
    if (class_of_.empty())
      throw Error(ErrorCode::out_of_range, cell_.file.string() + ": no part fits into the bin; wanted a larger one");
  }
  const int first_leaning = static_cast<int>(fill.bin_from_part.size());
  for (int i = first_leaning; i < static_cast<int>(solids.size()); ++i)
    fill.bin_from_part.push_back(upright_at_wall(*solids[i], i - first_leaning, fill.top_mm));
  heap_ = std::make_unique<LiveHeap>(bin, solids, fill.bin_from_part);
  constexpr int kLongest = 5 * 240;  // steps until the next one comes, however it rolls
  for (int i = first_leaning; i < static_cast<int>(solids.size()); ++i) {
    heap_->let_go(i);
    for (int step = 0; step < kLongest && !heap_->at_rest(); ++step) heap_->step();
  }
  for (const int k : class_of_) {
    PartTruth part;
    part.part = cell_.parts[k].name;
    truth_.parts.push_back(part);
  }
  note_scan();
  truth_.disturbed = 0;
}

/// A part on end beside a wall, every second one in a corner, a little tilted towards it: it leans there when it is let
/// go. \param above_mm  what lies below it
Pose CellWorld::upright_at_wall(const Solid& solid, int number, double above_mm) {
  constexpr double kGap_mm = 4;
  const Vec3 half(cell_.bin->inner_size_mm.x() / 2, cell_.bin->inner_size_mm.y() / 2, 0);
  const int wall = random_.integer(0, 3);
  const Vec3 to_wall = wall == 0   ? Vec3(1, 0, 0)
                       : wall == 1 ? Vec3(-1, 0, 0)
                       : wall == 2 ? Vec3(0, 1, 0)
                                   : Vec3(0, -1, 0);
  Pose pose = Pose::Identity();
  const double tilt = random_.uniform(2, 8) * kDegree;
  pose.linear() = rotation_from_vector(tilt * Vec3::UnitZ().cross(to_wall)) *
                  rotation_from_vector(Vec3(0, 0, random_.uniform(0, 2 * kPi))) *
                  rotation_from_vector(Vec3(random_.integer(0, 1) * kPi, 0, 0));
  Box box;
  for (const Vec3f& v : solid.mesh().vertices) {
    const Vec3 p = pose.linear() * v.cast<double>();
    box.min = box.min.cwiseMin(p), box.max = box.max.cwiseMax(p);
  }
  const Vec3 room = (half - box.size() / 2).cwiseMax(0.0) - Vec3(kGap_mm, kGap_mm, 0);
  Vec3 middle(random_.uniform(-room.x(), room.x()), random_.uniform(-room.y(), room.y()), 0);
  for (int k = 0; k < 2; ++k)
    if (to_wall[k] != 0)
      middle[k] = to_wall[k] * room[k];
    else if (number % 2 == 0)
      middle[k] = (middle[k] < 0 ? -1 : 1) * room[k];
  middle.z() = above_mm + box.size().z() / 2 + number * (box.size().z() + kGap_mm);
  pose.translation() = middle - box.center();
  return pose;
}

void CellWorld::add_tools(const WorkCell& cell) {
  tools_.resize(cell.grippers.size());
  for (std::size_t i = 0; i < tools_.size(); ++i) {
    Tool& tool = tools_[i];
    tool.shape = grasp::gripper_shape(cell.grippers[i]);
    for (const grasp::GripperPiece& piece : tool.shape.pieces) tool.meshes.push_back(mesh_of(piece.body));
    for (const Mesh& mesh : tool.meshes) tool.solids.emplace_back(mesh);
    for (const Solid& solid : tool.solids) tool.bodies.push_back(heap_->add_tool(solid));
    tool.opening_mm = tool.shape.jaws > 0 ? tool.shape.stroke_max() : 0;
  }
}

}  // namespace tribin::sim
