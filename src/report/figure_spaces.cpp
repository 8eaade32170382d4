#include <algorithm>
#include <cmath>
#include <set>

#include "report/html.hpp"
#include "report/sketch.hpp"
#include "report/space_art.hpp"
#include "report/spaces.hpp"

namespace tribin::report {
namespace {

constexpr double kWide = 380, kTall = 372, kArt = 300;

/// The largest cylinder of a sighting.
const Primitive* largest_cylinder(const Primitives& primitives, const Sighting& where) {
  for (int k : where.primitives)
    if (primitives.items[k].type == PrimitiveType::cylinder) return &primitives.items[k];
  return nullptr;
}

std::string shifted(const std::string& svg, double x, double y) {
  return "<g transform=\"translate(" + number(x, 1) + " " + number(y, 1) + ")\">" + svg + "</g>";
}

/// The surfel nearest to the middle of a cylinder's support that has nothing but the cylinder around it.
std::uint32_t middle_cell(const Surfels& surfels, const Primitive& cylinder) {
  Vec3f middle = Vec3f::Zero();
  for (std::uint32_t i : cylinder.surfels) middle += surfels.position[i] / static_cast<float>(cylinder.surfels.size());
  const Image<std::int32_t>& cells = surfels.surfel_of_cell;
  const std::set<std::uint32_t> own(cylinder.surfels.begin(), cylinder.surfels.end());
  const auto neighbours = [&](std::uint32_t i) {
    const int u = static_cast<int>(surfels.cell[i]) % cells.width, v = static_cast<int>(surfels.cell[i]) / cells.width;
    int count = 0;
    for (int dv = -3; dv <= 3; ++dv)  // the mask's 21 px and one cell more
      for (int du = -3; du <= 3; ++du)
        count += cells.contains(u + du, v + dv) && cells(u + du, v + dv) >= 0 &&
                 own.count(static_cast<std::uint32_t>(cells(u + du, v + dv)));
    return count;
  };
  std::uint32_t best = cylinder.surfels.front();
  int most = -1;
  for (std::uint32_t i : cylinder.surfels) {
    const int count = neighbours(i);
    if (count < most) continue;
    const bool nearer = (surfels.position[i] - middle).squaredNorm() < (surfels.position[best] - middle).squaredNorm();
    if (count > most || nearer) best = i, most = count;
  }
  return best;
}

/// (a) The raw points around one cell of the scan, the N x N mask in their tangent plane, and the means of its cells.
std::string tangent_mask(const Scan& scan, const Surfels& surfels, const Primitive& cylinder) {
  constexpr int kMask = 5;
  const std::uint32_t cell = middle_cell(surfels, cylinder);
  const int columns = surfels.surfel_of_cell.width;
  const int u0 = static_cast<int>(surfels.cell[cell]) % columns * surfels.cell_px + surfels.cell_px / 2;
  const int v0 = static_cast<int>(surfels.cell[cell]) / columns * surfels.cell_px + surfels.cell_px / 2;
  const Vec3 n = surfels.normal[cell].cast<double>(), at = surfels.position[cell].cast<double>();
  const Vec3 e1 = (Vec3(Vec3::UnitX()) - n * n.x()).normalized(), e2 = n.cross(e1);
  const double half = 10.5 * at.z() / scan.camera.fx;  // 21 px across
  View view =
      view_along((-0.55 * n + 0.75 * e2 + 0.35 * e1).normalized(), -n, at + 0.25 * half * n, 3.1 * half, 300, 300);
  Sketch out(view);
  const auto on_plane = [&](double a, double b) { return Vec3(at + half * (a * e1 + b * e2)); };
  out.polygon({on_plane(-1, -1), on_plane(1, -1), on_plane(1, 1), on_plane(-1, 1)}, "mask");
  for (int k = 1; k < kMask; ++k) {
    const double t = -1 + 2.0 * k / kMask;
    out.line(on_plane(t, -1), on_plane(t, 1), "mask");
    out.line(on_plane(-1, t), on_plane(1, t), "mask");
  }
  Vec3 sum[kMask][kMask];
  int count[kMask][kMask] = {};
  for (auto& row : sum)
    for (Vec3& s : row) s.setZero();
  for (int v = v0 - 16; v <= v0 + 16; ++v)
    for (int u = u0 - 16; u <= u0 + 16; ++u) {
      if (!scan.z_mm.contains(u, v) || !(scan.z_mm(u, v) > 0)) continue;
      const Vec3 x = scan.point(u, v), d = x - at;
      const double a = d.dot(e1) / half, b = d.dot(e2) / half;
      if (std::abs(a) >= 1 || std::abs(b) >= 1 || std::abs(d.dot(n)) > half) continue;
      out.dot(x, 1.3, "raw");
      const int i = static_cast<int>((a + 1) / 2 * kMask), j = static_cast<int>((b + 1) / 2 * kMask);
      sum[j][i] += x, ++count[j][i];
    }
  const auto mean = [&](int i, int j) { return Vec3(sum[j][i] / std::max(1, count[j][i])); };
  for (int j = 0; j < kMask; ++j)
    for (int i = 0; i < kMask; ++i) {
      if (!count[j][i]) continue;
      if (i + 1 < kMask && count[j][i + 1]) out.line(mean(i, j), mean(i + 1, j), "mesh");
      if (j + 1 < kMask && count[j + 1][i]) out.line(mean(i, j), mean(i, j + 1), "mesh");
      if (i + 1 < kMask && j + 1 < kMask && count[j + 1][i + 1]) out.line(mean(i, j), mean(i + 1, j + 1), "mesh");
    }
  for (int j = 0; j < kMask; ++j)
    for (int i = 0; i < kMask; ++i)
      if (count[j][i]) out.dot(mean(i, j), 3.6, "mean");
  const Vec3 z = -Vec3::UnitZ();  // towards the camera
  out.arrow(at, at + 1.3 * half * n, "v");
  out.text(at + 1.3 * half * n, 8, 4, "nᵢ", "vec");
  if (n.dot(z) < std::cos(3 * kDegree)) {
    out.arrow(at, at + 1.3 * half * z, "v");
    out.text(at + 1.3 * half * z, -26, 0, "n<tspan dy=\"4\" font-size=\"11\">z</tspan>", "vec");
    std::vector<Vec3> arc;
    for (int k = 0; k <= 12; ++k) arc.push_back(at + 0.8 * half * ((1 - k / 12.0) * z + k / 12.0 * n).normalized());
    out.path(arc, "thin");
    out.text(arc[6], -4, -8, "θ", "vec");
  }
  return out.svg();
}

/// A unit sphere seen from 30 degrees above, i to the right.
View sphere_view() {
  View view;
  view.view_from_world.row(0) = Vec3::UnitX().transpose();
  view.view_from_world.row(1) = Vec3(0, std::sin(30 * kDegree), -std::cos(30 * kDegree)).transpose();
  view.view_from_world.row(2) = Vec3(0, std::cos(30 * kDegree), std::sin(30 * kDegree)).transpose();
  view.px_per_mm = 118, view.width = view.height = 300;
  return view;
}

bool view_right(const View& view, const Vec3& direction) { return view.view_from_world.row(0).dot(direction) > 0; }

/// (d) The normals of one cylinder turned from the sphere's frame into the circle's.
std::string circle_frame(const Surfels& surfels, const Primitive& cylinder) {
  Sketch out(sphere_view());
  const Vec3 zero = Vec3::Zero(), k = Vec3::UnitZ();
  const Vec3 n = cylinder.axis.z() < 0 ? Vec3(-cylinder.axis) : cylinder.axis;
  const Vec3 l = n.cross(k).norm() > 1e-6 ? Vec3(n.cross(k).normalized()) : Vec3(Vec3::UnitX());
  const double theta = std::acos(std::clamp(n.dot(k), -1.0, 1.0));
  const Matrix3 turn = rotation_from_vector(theta * l);
  out.circle(zero, out.view().view_from_world.row(2).transpose(), 1, "thin");
  out.circle(zero, k, 1, "hair");
  out.circle(zero, n, 1, "hair");
  const std::size_t stride = std::max<std::size_t>(1, cylinder.surfels.size() / 220);
  for (std::size_t i = 0; i < cylinder.surfels.size(); i += stride) {
    const Vec3 x = surfels.normal[cylinder.surfels[i]].cast<double>();
    out.dot(x.z() < 0 ? Vec3(-x) : x, 1.8, "before");
    out.dot(turn * x, 1.8, "after");
  }
  out.arrow(zero, n, "v");
  out.text(n, 8, 4, "n = (x, y, z)", "vec");
  out.arrow(zero, 1.12 * k, "v");
  out.text(1.12 * k, -24, 4, "k", "vec");
  out.arrow(zero, 1.1 * l, "v");
  out.text(1.1 * l, view_right(out.view(), l) ? -66 : -20, view_right(out.view(), l) ? 24 : -10, "l = n × k", "vec");
  std::vector<Vec3> arc;
  for (int i = 0; i <= 16; ++i) arc.push_back(0.5 * (rotation_from_vector(theta * i / 16 * l) * n));
  out.path(arc, "thin");
  out.text(arc[8], 2, -6, "θ", "vec");
  return out.svg();
}

/// (f) The votes as bars over the disc of axes.
std::string vote_bars(const std::vector<float>& votes) {
  View view = sphere_view();
  view.center = Vec3(0, 0, 0.35);
  Sketch out(view);
  const float most = votes.empty() ? 0 : *std::max_element(votes.begin(), votes.end());
  for (double radius : {0.5, 0.866, 1.0}) out.circle(Vec3::Zero(), Vec3::UnitZ(), radius, "hair");
  const std::vector<Vec3f> centres = golden_spiral(static_cast<int>(votes.size()));
  std::vector<std::pair<double, std::size_t>> order;  // from the back to the front
  for (std::size_t i = 0; i < votes.size(); ++i)
    if (most > 0 && votes[i] > 1e-3 * most) order.emplace_back(-centres[i].y(), i);
  std::sort(order.begin(), order.end());
  for (const auto& [depth, i] : order) {
    const double level = votes[i] / most;
    const double q = std::sqrt(1 / (1 + std::max(0.f, centres[i].z())));  // equal areas stay equal
    const Vec3 foot(centres[i].x() * q, centres[i].y() * q, 0);
    out.line(
        foot, foot + Vec3(0, 0, 1.1 * level),
        "dot bar m" + std::to_string(std::min(kVoteColours - 1, static_cast<int>(std::cbrt(level) * kVoteColours))));
  }
  return out.svg();
}

}  // namespace

std::string figure_spaces(const Scan& scan, const Part& part, const Found& found, const Instance& instance) {
  const Sighting where = sighting_of(scan, found.surfels, found.primitives, part, instance.camera_from_part);
  const SpaceArt art = space_art({scan, found.surfels, found.primitives}, where);
  const Primitive* cylinder = largest_cylinder(found.primitives, where);
  const auto x_of = [](int k) { return 16 + (k % 3) * (kWide + 16); };
  const auto y_of = [](int k) { return 16 + (k / 3) * (kTall + 16); };
  const auto panel = [&](int k, const std::vector<std::string>& caption, const std::string& body) {
    return card(x_of(k), y_of(k), kWide, kTall, std::string(1, static_cast<char>('a' + k)), caption, body);
  };
  const auto art_at = [&](int k, const std::string& svg) { return placed(svg, x_of(k) + 40, y_of(k) + 8, kArt); };
  const auto sketch_at = [&](int k, const std::string& svg) { return shifted(svg, x_of(k) + 40, y_of(k) + 8); };
  std::string out;
  out += panel(0, {"Tangent plane mask: raw points (grey), their", "mean in each cell of the 5 × 5 mask, triangles"},
               cylinder ? sketch_at(0, tangent_mask(scan, found.surfels, *cylinder)) : "");
  out += panel(1, {"IJK space, flat surfels: each dense spot is a", "direction of planes"}, art_at(1, art.flat));
  out += panel(2, {"IJK space, curved surfels: a cylinder is a great", "circle, a cone a small one"},
               art_at(2, art.curved));
  out += panel(3, {"From the sphere's frame (orange) to the circle's", "(green): a turn about l by θ, equation (3)"},
               cylinder ? sketch_at(3, circle_frame(found.surfels, *cylinder)) : "");
  out += panel(4, {"Parameter space: votes for the axis, θ outwards,", "φ around, logarithmic"}, art_at(4, art.votes));
  out += panel(5, {"The same as a histogram: the highest cell is the", "axis with the most area"},
               sketch_at(5, vote_bars(found.primitives.spaces.parameter)));
  return figure_file(1220, 804, "Normals, IJK space and parameter space", out);
}

}  // namespace tribin::report
