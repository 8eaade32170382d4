#include "report/palette.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tribin/core/error.hpp"

namespace tribin::report {
namespace {

constexpr Rgb rgb(std::uint32_t hex) {
  return {static_cast<std::uint8_t>(hex >> 16), static_cast<std::uint8_t>(hex >> 8 & 255),
          static_cast<std::uint8_t>(hex & 255)};
}

// The tokens of style.cpp; pictures cannot read CSS variables.
struct Tokens {
  std::uint32_t plane, cylinder, cone, sphere, none, grey, faint, line, halo;
  std::uint32_t classes[6];
};
constexpr Tokens kLight{
    0x1B55B3, 0xD0640A, 0x0A9686, 0x8A1A55, 0x7A828E,
    0x9AA1AC, 0xC3C8D0, 0x3A414C, 0xFFFFFF, {0x282B86, 0xA06A00, 0x1D8475, 0x944AAD, 0x495D00, 0x661E1F}};
constexpr Tokens kDark{
    0x4A93F5, 0xF7A03C, 0x5CE6D3, 0xD04A8C, 0x8A929E,
    0x7F8793, 0x454C58, 0xD5DAE2, 0x171A20, {0xB8C0F8, 0xE5A111, 0x4BAB94, 0xA870BE, 0xD1F29F, 0xCF661E}};

Rgb mixed(const Rgb& a, const Rgb& b, double t) {
  Rgb out;
  for (int i = 0; i < 3; ++i) out[i] = static_cast<std::uint8_t>(std::lround(a[i] + t * (b[i] - a[i])));
  return out;
}

template <std::size_t N>
Rgb along(const std::uint32_t (&stops)[N], double t) {
  const double place = std::clamp(t, 0.0, 1.0) * (N - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(place), N - 2);
  return mixed(rgb(stops[i]), rgb(stops[i + 1]), place - i);
}

/// Shade 0 is a deep shadow, 0.8 the colour itself, 1 a highlight.
Rgb shaded(const Rgb& colour, double shade) {
  if (shade <= 0.8) return mixed(mixed(colour, rgb(0x05070A), 0.62), colour, shade / 0.8);
  return mixed(colour, rgb(0xFFFFFF), (shade - 0.8) / 0.2 * 0.22);
}

}  // namespace

Material material_of(PrimitiveType type) {
  return type == PrimitiveType::torus ? Material::sphere : static_cast<Material>(type);  // both bend two ways
}

std::uint8_t index_of(Material material, double shade, int step) {
  const int level = std::clamp(static_cast<int>(shade * kShades), 0, kShades - 1);
  return static_cast<std::uint8_t>(1 + (static_cast<int>(material) + step) * kShades + level);
}

std::vector<Rgb> palette(bool dark, int part_class) {
  static_assert(1 + (static_cast<int>(Material::height) + kHeights) * kShades <= 256);
  const Tokens& t = dark ? kDark : kLight;
  const std::uint32_t colours[] = {
      t.plane, t.cylinder, t.cone, t.sphere, t.none, t.grey, t.faint, t.line, t.classes[std::max(0, part_class) % 6],
      t.halo};
  std::vector<Rgb> out(1, rgb(t.halo));
  for (std::size_t m = 0; m < std::size(colours); ++m) {
    const bool is_line = m >= static_cast<std::size_t>(Material::line);  // lines have no shadow side
    for (int s = 0; s < kShades; ++s)
      out.push_back(is_line ? rgb(colours[m]) : shaded(rgb(colours[m]), (s + 0.5) / kShades));
  }
  for (int h = 0; h < kHeights; ++h)
    for (int s = 0; s < kShades; ++s)
      if (part_class < 0)
        out.push_back(shaded(rgb(t.classes[h % 6]), (s + 0.5) / kShades));
      else
        out.push_back(shaded(viridis(h / (kHeights - 1.0)), 0.25 + 0.75 * (s + 0.5) / kShades));
  return out;
}

Rgb viridis(double t) {
  static constexpr std::uint32_t kStops[] = {0x440154, 0x472D7B, 0x3B528B, 0x2C728E, 0x21918C,
                                             0x28AE80, 0x5EC962, 0xADDC30, 0xFDE725};
  return along(kStops, t);
}

Rgb magma(double t) {
  static constexpr std::uint32_t kStops[] = {0x000004, 0x1D1147, 0x51127C, 0x832681, 0xB73779,
                                             0xE75263, 0xFC8961, 0xFEC488, 0xFCFDBF};
  return along(kStops, t);
}

std::string hex(const Rgb& colour) {
  char out[8];
  std::snprintf(out, sizeof out, "#%02x%02x%02x", colour[0], colour[1], colour[2]);
  return out;
}

}  // namespace tribin::report
