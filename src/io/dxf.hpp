#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/file_bytes.hpp"
#include "tribin/core/geometry.hpp"

namespace tribin::io {

/// One group of a DXF file: its code, its value, where it is.
struct DxfGroup {
  int code = 0;
  std::string_view value;
  std::size_t offset = 0;
};

/// Reads a DXF file group by group; comments (999) are left out.
class DxfGroups {
 public:
  explicit DxfGroups(const FileBytes& file);
  const FileBytes& file() const { return file_; }
  /// The next group; bad_input where the file ends without "EOF" or a code is no number.
  DxfGroup next();
  double number(const DxfGroup& group) const;
  std::int64_t whole(const DxfGroup& group) const;
  [[noreturn]] void fail(const DxfGroup& group, std::string_view seen, std::string_view wanted) const;

  /// Faces that smoothing may still make, all MESHes of the file together: a level takes four times as many.
  std::size_t smooth_faces_left = 1'000'000;

 private:
  const FileBytes& file_;
  std::size_t at_ = 0;
};

/// An entity: the group with code 0 first, then its own groups.
using DxfEntity = std::vector<DxfGroup>;

struct DxfFacets {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  /// Adds a polygon by its corners in space.
  void add_polygon(const std::vector<Vec3>& corners);
};

/// A block put in place: once, or in rows and columns.
struct DxfInsert {
  std::string block;
  Eigen::Affine3d place = Eigen::Affine3d::Identity();  ///< without the block's base point
  Vec3 row_step = Vec3::Zero(), column_step = Vec3::Zero();
  std::size_t rows = 1, columns = 1;
};

struct DxfBlock {
  Vec3 base = Vec3::Zero();
  DxfFacets facets;
  std::vector<DxfInsert> inserts;
  std::map<std::string, std::size_t> ignored;  ///< entities that are no surface or not supported, by type
  std::size_t too_smooth = 0;                  ///< MESHes with more levels of smoothing than were read
};

/// Reads the entities of a block or of the model, up to ENDBLK or ENDSEC.
///
/// 3DFACE; POLYLINE as polyface (negative numbers mark invisible edges only) and as polymesh m x n, open or closed;
/// MESH with its levels of smoothing; INSERT with scale, rotation, extrusion, rows and columns. Entities on paper space
/// are left out.
DxfBlock read_dxf_entities(DxfGroups& groups, std::string_view end);

/// Adds a MESH entity to a block: its cage, smoothed as often as the entity says.
void add_dxf_mesh(DxfGroups& groups, const DxfEntity& entity, DxfBlock& block);

}  // namespace tribin::io
