#pragma once

#include <concepts>
#include <optional>
#include <type_traits>

#include "tribin/part/part.hpp"

namespace tribin::part_detail {

// The fields of everything that a Part holds, in file order, for writing and for reading. Structured bindings name all
// fields of a struct or do not compile: a field that is added there cannot be forgotten here.
// After such a change kPartFileVersion goes up by one.

template <class T, class Struct>
concept Is = std::same_as<std::remove_const_t<T>, Struct>;

template <class Archive, Is<CadFace> T>
void each_field(Archive& to, T& face) {
  auto& [id, type, axis, point, radius, minor_radius, half_angle, concave, area] = face;
  to(id, type, axis, point, radius, minor_radius, half_angle, concave, area);
}

template <class Archive, Is<Mesh> T>
void each_field(Archive& to, T& mesh) {
  auto& [vertices, triangles, face_of_triangle, faces, chord_error, oriented, name, warnings] = mesh;
  to(vertices, triangles, face_of_triangle, faces, chord_error, oriented, name, warnings);
}

template <class Archive, Is<RenderMesh> T>
void each_field(Archive& to, T& mesh) {
  auto& [vertices, triangles, normals, offsets, edges, two_sided, box_min, box_max] = mesh;
  to(vertices, triangles, normals, offsets, edges, two_sided, box_min, box_max);
}

template <class Archive, Is<BoundaryCircle> T>
void each_field(Archive& to, T& circle) {
  auto& [center, radius, rms, arc] = circle;
  to(center, radius, rms, arc);
}

template <class Archive, Is<BoundaryLoop> T>
void each_field(Archive& to, T& loop) {
  auto& [inner, points, circle] = loop;
  to(inner, points, circle);
}

template <class Archive, Is<Primitive> T>
void each_field(Archive& to, T& primitive) {
  auto& [id, type, axis, point, offset, radius, minor_radius, half_angle, extent_min, extent_max, arc, concave, fillet,
         radius_from_cad, area, rms, points, covariance, surfels, loops, peak, name] = primitive;
  to(id, type, axis, point, offset, radius, minor_radius, half_angle, extent_min, extent_max, arc, concave, fillet,
     radius_from_cad, area, rms, points, covariance, surfels, loops, peak, name);
}

template <class Archive, Is<Relation> T>
void each_field(Archive& to, T& relation) {
  auto& [first, second, type, angle, distance, adjacent, coaxial, line_point, line_direction] = relation;
  to(first, second, type, angle, distance, adjacent, coaxial, line_point, line_direction);
}

template <class Archive, Is<PrimitiveModel> T>
void each_field(Archive& to, T& model) {
  auto& [primitives, relations] = model;
  to(primitives, relations);
}

template <class Archive, Is<ContinuousSymmetry> T>
void each_field(Archive& to, T& symmetry) {
  auto& [axis, point] = symmetry;
  to(axis, point);
}

template <class Archive, Is<SymmetryGroup> T>
void each_field(Archive& to, T& group) {
  auto& [discrete, continuous] = group;
  to(discrete, continuous);
}

template <class Archive, Is<SelfSimilarPose> T>
void each_field(Archive& to, T& similar) {
  auto& [part_from_part, overlap, discriminating_points] = similar;
  to(part_from_part, overlap, discriminating_points);
}

template <class Archive, Is<PartView> T>
void each_field(Archive& to, T& view) {
  auto& [direction, points, normals, area] = view;
  to(direction, points, normals, area);
}

template <class Archive, Is<Part> T>
void each_field(Archive& to, T& part) {
  auto& [name, mesh, render_mesh, coarse_mesh, coarse_error, model, exposed, primitive_of_triangle, box_min, box_max,
         diameter, largest_face, area, gyration, symmetry, declared, self_similar, nearly_round, views, sample_points,
         sample_normals, warnings] = part;
  to(name, mesh, render_mesh, coarse_mesh, coarse_error, model, exposed, primitive_of_triangle, box_min, box_max,
     diameter, largest_face, area, gyration, symmetry, declared, self_similar, nearly_round, views, sample_points,
     sample_normals, warnings);
}

// The last value of each enum that is stored: a byte above it is no such enum.
constexpr SurfaceType last_of(SurfaceType) { return SurfaceType::free_form; }
constexpr PrimitiveType last_of(PrimitiveType) { return PrimitiveType::torus; }
constexpr RelationType last_of(RelationType) { return RelationType::cylinder_cylinder; }

// Types whose bytes are their value: numbers, and fixed arrays of them without gaps.
template <class T>
struct IsFlat : std::bool_constant<std::is_arithmetic_v<T> && !std::same_as<T, bool>> {};
template <class T, int Rows, int Columns>
struct IsFlat<Eigen::Matrix<T, Rows, Columns, Eigen::DontAlign>> : std::true_type {
  static_assert(sizeof(Eigen::Matrix<T, Rows, Columns, Eigen::DontAlign>) == sizeof(T) * Rows * Columns);
};
template <class T, std::size_t N>
struct IsFlat<std::array<T, N>> : IsFlat<T> {};
template <>
struct IsFlat<Pose> : std::true_type {
  static_assert(sizeof(Pose) == 16 * sizeof(double));
};
template <>
struct IsFlat<OutlineEdge> : std::true_type {
  static_assert(sizeof(OutlineEdge) == 16);
};

}  // namespace tribin::part_detail
