#pragma once

#include "io/toml_fields.hpp"
#include "tribin/config/work_cell.hpp"

namespace tribin::config {

/// A pose: {translation_mm, rotation_deg = {convention, values}}; what is left out is the identity.
Pose read_pose(const io::TomlPlace& place);
/// The same with sigma_mm and sigma_deg.
CellHandEye read_uncertain_pose(const io::TomlPlace& place);
/// The keys of a pose, for the page.
std::vector<io::KeyRow> pose_rows();

inline constexpr const char* kPoseFallback = "identity";

/// A key with a pose.
template <class T>
void add_pose(io::Fields<T>& fields, const char* key, Pose T::*member, const char* meaning) {
  fields.value(key, "", "pose", kPoseFallback, member, meaning, read_pose);
}

}  // namespace tribin::config
