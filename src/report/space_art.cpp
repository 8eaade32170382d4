#include "report/space_art.hpp"

#include <algorithm>
#include <cmath>

#include "report/links.hpp"
#include "report/spaces.hpp"

namespace tribin::report {
namespace {

std::vector<PeakMark> marks(const Primitives& primitives, const Sighting& where, PrimitiveType type, std::size_t most) {
  std::vector<PeakMark> out;
  for (int k : where.primitives) {
    const Primitive& p = primitives.items[k];
    if (p.type != type) continue;
    const auto same = std::find_if(out.begin(), out.end(), [&](const PeakMark& m) {
      return std::abs(m.direction.dot(p.axis)) > std::cos(10 * kDegree);  // one ring for those that would overlap
    });
    if (same != out.end())
      same->keys.push_back(scan_key(p.id));
    else if (out.size() < most)
      out.push_back({p.axis, (type == PrimitiveType::plane ? "P" : "C") + std::to_string(p.id), {scan_key(p.id)}});
  }
  return out;
}

std::vector<CircleMark> circles(const Primitives& primitives, const Sighting& where, std::size_t most) {
  std::vector<CircleMark> out;
  for (int k : where.primitives) {
    const Primitive& p = primitives.items[k];
    if (p.type != PrimitiveType::cylinder && p.type != PrimitiveType::cone) continue;
    const bool cone = p.type == PrimitiveType::cone;
    const auto alike = [&](const CircleMark& m) { return m.type == name_of(p.type); };
    const CircleMark mark{p.axis,
                          cone ? (p.concave ? 1 : -1) * std::sin(p.half_angle) : 0,
                          "C" + std::to_string(p.id),
                          name_of(p.type),
                          {scan_key(p.id)}};
    const auto same = std::find_if(out.begin(), out.end(), [&](const CircleMark& m) {
      return std::abs(m.axis.dot(mark.axis)) > std::cos(3 * kDegree) && std::abs(m.d - mark.d) < 0.05;
    });
    if (same != out.end())
      same->keys.push_back(scan_key(p.id));
    else if (static_cast<std::size_t>(std::count_if(out.begin(), out.end(), alike)) < most)
      out.push_back(mark);
  }
  return out;
}

}  // namespace

SpaceArt space_art(const Observation& seen, const Sighting& where) {
  const auto of_shape = [&](auto keep) {
    std::vector<std::uint32_t> out;
    for (std::uint32_t i : where.surfels)
      if (keep(seen.surfels.shape[i])) out.push_back(i);
    return count_normals(seen.surfels, out, 4096);
  };
  const auto all = count_normals(seen.surfels, where.surfels, 4096);
  const auto flat = of_shape([](SurfelShape s) { return s == SurfelShape::flat; });
  const auto curved = of_shape([](SurfelShape s) { return s == SurfelShape::ruled || s == SurfelShape::curved; });
  SpaceArt out;
  out.all = sphere_svg(all, {}, {}, "Half sphere of all normals");
  out.flat =
      sphere_svg(flat, marks(seen.primitives, where, PrimitiveType::plane, 5), {}, "Half sphere of flat surfels");
  out.curved = sphere_svg(curved, {}, circles(seen.primitives, where, 2), "Half sphere of curved surfels");
  out.votes = disc_svg(seen.primitives.spaces.parameter, marks(seen.primitives, where, PrimitiveType::cylinder, 5),
                       "Equal-area disc of axis votes");
  return out;
}

}  // namespace tribin::report
