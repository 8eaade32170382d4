#pragma once

#include <vector>

#include "report/png.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin::report {

/// What a surface of a picture is made of. Each material has kShades entries of the palette, dark to bright.
enum class Material : std::uint8_t { plane, cylinder, cone, sphere, none, grey, faint, line, class_line, halo, height };

inline constexpr int kShades = 10;
inline constexpr int kHeights = 15;  ///< steps of the height colours, each with kShades: all fit 256 entries

Material material_of(PrimitiveType type);

/// Palette index of a material. \param shade in [0, 1]. \param step of the height colours, in [0, kHeights).
std::uint8_t index_of(Material material, double shade, int step = 0);

/// The 256 colours, for light or dark pages.
/// \param part_class  0 = A ...: the colour of Material::class_line; < 0: the height steps are the classes' colours.
std::vector<Rgb> palette(bool dark, int part_class);

/// Matplotlib's maps (CC0), t in [0, 1].
Rgb viridis(double t);
Rgb magma(double t);

/// "#rrggbb"
std::string hex(const Rgb& colour);

}  // namespace tribin::report
