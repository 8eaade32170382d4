#include "report/spaces.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "report/html.hpp"
#include "report/links.hpp"

namespace tribin::report {
namespace {

constexpr double kRadius = 84, kMiddle = 100;  // of a picture of 200 x 200
constexpr double kTilt = -30 * kDegree;

struct Spot {
  double x, y, z;  ///< z > 0 faces the reader
};

Spot on_sphere(const Vec3& v) {
  const double y = v.y() * std::cos(kTilt) - v.z() * std::sin(kTilt);
  const double z = v.y() * std::sin(kTilt) + v.z() * std::cos(kTilt);
  return {kMiddle + kRadius * v.x(), kMiddle + 2 - kRadius * y, z};
}

/// Lambert's equal-area map of the half sphere z >= 0.
Spot on_disc(const Vec3& v) {
  const double q = std::sqrt(1 / (1 + std::max(0.0, v.z())));
  return {kMiddle + kRadius * 1.08 * v.x() * q, kMiddle - kRadius * 1.08 * v.y() * q, 1};
}

Vec3 upward(const Vec3& v) { return v.z() < 0 ? Vec3(-v) : v; }

std::string text(const char* format, double a, double b) {
  char out[64];
  std::snprintf(out, sizeof out, format, a, b);
  return out;
}

/// A path through points; hidden points break it.
template <class PointAt>
std::string path_of(int count, const PointAt& point_at) {
  std::string d;
  bool pen_down = false;
  for (int i = 0; i <= count; ++i) {
    const Spot s = point_at(2 * kPi * i / count);
    if (s.z < -0.02) {
      pen_down = false;
      continue;
    }
    d += text(pen_down ? "L%.1f %.1f" : "M%.1f %.1f", s.x, s.y);
    pen_down = true;
  }
  return d;
}

/// Dots of one colour and size are one path of strokes without length: a tenth of the bytes of circles.
struct Dots {
  std::string path[kVoteColours];
  void add(int level, const Spot& s) { path[level] += text("M%.1f %.1fh0", s.x, s.y); }
  std::string svg(double width0, double width1) const {
    std::string out;
    for (int level = 0; level < kVoteColours; ++level) {
      if (path[level].empty()) continue;
      out += "<path class=\"dot m" + std::to_string(level) + "\" stroke-width=\"" +
             text("%.1f", width0 + (width1 - width0) * level / (kVoteColours - 1), 0) + "\" d=\"" + path[level] +
             "\"/>";
    }
    return out;
  }
};

std::string ring(const Spot& s, const std::string& css, const PeakMark& peak) {
  std::string out = "<circle class=\"ring " + css + "\"" + link_to(peak.keys) + " r=\"7\" " +
                    text("cx=\"%.1f\" cy=\"%.1f\"/>", s.x, s.y);
  const bool left = s.x > 165;
  out += "<text class=\"mark\" " + text("x=\"%.1f\" y=\"%.1f\"", s.x + (left ? -9 : 9), s.y + 4) +
         (left ? " text-anchor=\"end\">" : ">") + escaped(peak.label) + "</text>";
  return out;
}

std::string open_svg(const std::string& title) {
  return "<svg viewBox=\"0 0 200 200\" role=\"img\" aria-label=\"" + escaped(title) + "\">";
}

}  // namespace

std::vector<float> count_normals(const Surfels& surfels, const std::vector<std::uint32_t>& which, int bins) {
  const std::vector<Vec3f> centres = golden_spiral(bins);
  std::vector<float> out(bins, 0.f);
  for (std::uint32_t i : which) {
    const Vec3f n = surfels.normal[i].z() < 0 ? Vec3f(-surfels.normal[i]) : surfels.normal[i];
    std::size_t best = 0;
    float best_dot = -2;
    for (std::size_t b = 0; b < centres.size(); ++b) {
      const float dot = std::abs(n.dot(centres[b]));
      if (dot > best_dot) best_dot = dot, best = b;
    }
    out[best] += surfels.area_mm2[i];
  }
  return out;
}

std::string sphere_svg(const std::vector<float>& bins, const std::vector<PeakMark>& peaks,
                       const std::vector<CircleMark>& circles, const std::string& title) {
  std::string out = open_svg(title);
  out += "<circle class=\"globe\" cx=\"100\" cy=\"102\" r=\"84\"/><path class=\"graticule\" d=\"";
  for (int theta : {30, 60, 90})
    out += path_of(72, [&](double phi) {
      const double t = theta * kDegree;
      return on_sphere({std::sin(t) * std::cos(phi), std::sin(t) * std::sin(phi), std::cos(t)});
    });
  for (int azimuth = 0; azimuth < 180; azimuth += 30)
    out += path_of(72, [&](double a) {
      const double b = azimuth * kDegree;
      Spot s = on_sphere({std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)});
      if (std::cos(a) < -0.01) s.z = -1;  // only the half sphere
      return s;
    });
  out += "\"/>";
  const float most = bins.empty() ? 0 : *std::max_element(bins.begin(), bins.end());
  Dots dots;
  if (most > 0) {
    const std::vector<Vec3f> centres = golden_spiral(static_cast<int>(bins.size()));
    for (std::size_t i = 0; i < bins.size(); ++i) {
      if (bins[i] <= 0) continue;
      const Spot s = on_sphere(centres[i].cast<double>());
      if (s.z < 0) continue;
      dots.add(std::min(kVoteColours - 1, static_cast<int>(std::cbrt(bins[i] / most) * kVoteColours)), s);
    }
  }
  out += dots.svg(1.9, 4.4);
  for (const CircleMark& c : circles) {
    const Vec3 axis = c.axis.normalized();
    Vec3 u, v;
    orthonormal_basis(axis, u, v);
    const double r = std::sqrt(std::max(0.0, 1 - c.d * c.d));
    const std::string d = path_of(120, [&](double t) {
      const Vec3 n = c.d * axis + r * (std::cos(t) * u + std::sin(t) * v);
      Spot s = on_sphere(-n);  // normals that the camera sees point towards it: the half sphere shows their opposites
      if (n.z() > 0.01) s.z = -1;
      return s;
    });
    out += "<path class=\"circle-halo\" d=\"" + d + "\"/><path class=\"circle " + c.type + "\"" + link_to(c.keys) +
           " d=\"" + d + "\"/>";
  }
  for (const PeakMark& peak : peaks) {
    const Spot s = on_sphere(upward(peak.direction));
    if (s.z >= 0) out += ring(s, "plane", peak);
  }
  const char* const names[] = {"i", "j", "k"};
  for (int axis = 0; axis < 3; ++axis) {
    Spot s = on_sphere(1.1 * Vec3::Unit(axis));
    for (const PeakMark& peak : peaks) {  // a ring's label goes first
      const Spot ring_at = on_sphere(upward(peak.direction));
      if (std::abs(ring_at.y - s.y) < 12 && s.x > ring_at.x - 12 && s.x < ring_at.x + 40) s.y = ring_at.y - 16;
    }
    out += "<text class=\"axis a" + std::to_string(axis) + "\" text-anchor=\"middle\" " +
           text("x=\"%.1f\" y=\"%.1f\">", s.x, std::max(9.0, s.y + 4)) + names[axis] + "</text>";
  }
  return out + "</svg>";
}

std::string disc_svg(const std::vector<float>& bins, const std::vector<PeakMark>& peaks, const std::string& title) {
  std::string out = open_svg(title);
  out += "<circle class=\"globe\" cx=\"100\" cy=\"100\" r=\"93\"/>";
  const float most = bins.empty() ? 0 : *std::max_element(bins.begin(), bins.end());
  Dots dots;
  if (most > 0) {
    const std::vector<Vec3f> centres = golden_spiral(static_cast<int>(bins.size()));
    // Logarithmic over three decades below the highest peak.
    for (std::size_t i = 0; i < bins.size(); ++i) {
      const double level = bins[i] > 0 ? 1 + std::log10(bins[i] / most) / 3 : -1;
      if (level > 0)
        dots.add(std::min(kVoteColours - 1, static_cast<int>(level * kVoteColours)),
                 on_disc(centres[i].cast<double>()));
    }
  }
  out += dots.svg(4.6, 4.6) + "<path class=\"graticule\" d=\"";
  for (int theta : {30, 60, 90})
    out += path_of(72, [&](double phi) {
      const double t = theta * kDegree;
      return on_disc({std::sin(t) * std::cos(phi), std::sin(t) * std::sin(phi), std::cos(t)});
    });
  out += "\"/>";
  for (const PeakMark& peak : peaks) {
    const Vec3 axis = upward(peak.direction.normalized());
    if (axis.z() < 0.25) {  // an axis and its opposite are one: near the rim the twin lies across
      const Spot twin = on_disc({-axis.x(), -axis.y(), 0});
      out += "<circle class=\"ring cylinder twin\"" + link_to(peak.keys) + " r=\"7\" " +
             text("cx=\"%.1f\" cy=\"%.1f\"/>", twin.x, twin.y);
    }
    out += ring(on_disc(axis), "cylinder", peak);
  }
  return out + "</svg>";
}

}  // namespace tribin::report
