#include "report/sketch.hpp"

#include <cmath>
#include <cstdio>

#include "report/html.hpp"
#include "report/spaces.hpp"

namespace tribin::report {
namespace {

std::string pair(double x, double y) {
  char out[64];
  std::snprintf(out, sizeof out, "%.1f %.1f", x, y);
  return out;
}

std::string num(double v) {
  char out[32];
  std::snprintf(out, sizeof out, "%.1f", v);
  return out;
}

// The report's light tokens; a figure stands on its own white ground.
const char* const kFigureStyle = R"css(
text{font:13px "Inter Variable",Inter,system-ui,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;fill:#14171C}
.paper{fill:#fff}.card{fill:#fff;stroke:#DDE1E7}.cap{font-size:13px;fill:#454D59}.letter{font-weight:700}.title{font-size:14px;font-weight:600}
.small{font-size:12px;fill:#454D59}.vec{font-size:15px;font-weight:600;paint-order:stroke;stroke:#fff;stroke-width:4px;stroke-linejoin:round}
.flow{fill:none;stroke:#7C8491;stroke-width:1.6}.flow-head{fill:#7C8491}
.thin{fill:none;stroke:#7C8491;stroke-width:1}.hair{fill:none;stroke:#B7BDC7;stroke-width:.8}.dash{fill:none;stroke:#5E6774;stroke-width:1.2;stroke-dasharray:4 4}
.main{fill:none;stroke:#D0640A;stroke-width:2.4}.sub{fill:none;stroke:#8A1A55;stroke-width:2.4}.plane-line{fill:none;stroke:#1B55B3;stroke-width:2.2}
.plane-fill{fill:#1B55B3;fill-opacity:.22;stroke:#1B55B3;stroke-width:1.4}.v{fill:none;stroke:#14171C;stroke-width:2}.v-head{fill:#14171C}
.point{fill:#fff;stroke:#14171C;stroke-width:1.6}.p{fill:#930120;stroke:#fff;stroke-width:1.4}.raw{fill:#7C8491}.mean{fill:#D0640A;stroke:#fff;stroke-width:1}
.before{fill:#D0640A}.after{fill:#0A9686}.mesh{fill:none;stroke:#D0640A;stroke-width:1.1}.mask{fill:#4B45C6;fill-opacity:.07;stroke:#4B45C6;stroke-width:1}
.globe{fill:#F5F6F8;stroke:#DDE1E7}.graticule{fill:none;stroke:#DDE1E7;stroke-width:.7}.dot{fill:none;stroke-linecap:round}.bar{stroke-width:3.2}
.ring{fill:none;stroke-width:1.6}.ring.plane{stroke:#1B55B3}.ring.cylinder{stroke:#D0640A}.twin{stroke-dasharray:3 3}
.mark{font-size:10px;font-weight:600;paint-order:stroke;stroke:#fff;stroke-width:3px;stroke-linejoin:round}
.circle{fill:none;stroke-width:1.8}.circle.cylinder{stroke:#D0640A}.circle.cone{stroke:#0A9686}.circle-halo{fill:none;stroke:#fff;stroke-width:3.6;stroke-opacity:.8}
.axis{font-size:10px;font-weight:600}.a0{fill:#B8141F}.a1{fill:#00786A}.a2{fill:#1B55B3}
)css";

}  // namespace

std::string Sketch::at(const Vec3& world) const {
  const Vec3 p = view_.project(world);
  return pair(p.x(), p.y());
}

void Sketch::line(const Vec3& from, const Vec3& to, const std::string& css) {
  out_ += "<path class=\"" + css + "\" d=\"M" + at(from) + "L" + at(to) + "\"/>";
}

void Sketch::arrow(const Vec3& from, const Vec3& to, const std::string& css) {
  const Vec3 a = view_.project(from), b = view_.project(to);
  const double length = std::hypot(b.x() - a.x(), b.y() - a.y());
  line(from, to, css);
  if (length < 1) return;
  const double x = (b.x() - a.x()) / length, y = (b.y() - a.y()) / length, tip = 10, half = 4;
  out_ += "<path class=\"" + css + "-head\" d=\"M" + pair(b.x() + 2 * x, b.y() + 2 * y) + "L" +
          pair(b.x() - tip * x - half * y, b.y() - tip * y + half * x) + "L" +
          pair(b.x() - tip * x + half * y, b.y() - tip * y - half * x) + "z\"/>";
}

void Sketch::path(const std::vector<Vec3>& points, const std::string& css) {
  std::string d;
  for (const Vec3& p : points) d += (d.empty() ? "M" : "L") + at(p);
  out_ += "<path class=\"" + css + "\" d=\"" + d + "\"/>";
}

void Sketch::polygon(const std::vector<Vec3>& corners, const std::string& css) {
  std::string d;
  for (const Vec3& p : corners) d += (d.empty() ? "M" : "L") + at(p);
  out_ += "<path class=\"" + css + "\" d=\"" + d + "z\"/>";
}

void Sketch::circle(const Vec3& center, const Vec3& axis, double radius_mm, const std::string& css) {
  Vec3 u, v;
  orthonormal_basis(axis, u, v);
  std::vector<Vec3> points;
  for (int k = 0; k < 72; ++k) {
    const double t = 2 * kPi * k / 72;
    points.push_back(center + radius_mm * (std::cos(t) * u + std::sin(t) * v));
  }
  polygon(points, css);
}

void Sketch::dot(const Vec3& where, double radius_px, const std::string& css) {
  const Vec3 p = view_.project(where);
  out_ += "<circle class=\"" + css + "\" cx=\"" + num(p.x()) + "\" cy=\"" + num(p.y()) + "\" r=\"" + num(radius_px) +
          "\"/>";
}

void Sketch::text(const Vec3& where, double dx, double dy, const std::string& words, const std::string& css) {
  const Vec3 p = view_.project(where);
  out_ +=
      "<text class=\"" + css + "\" x=\"" + num(p.x() + dx) + "\" y=\"" + num(p.y() + dy) + "\">" + words + "</text>";
}

std::string image_svg(const Canvas& canvas, int part_class, double x, double y, double width) {
  const double height = width * canvas.indices.height / canvas.indices.width;
  return "<image x=\"" + num(x) + "\" y=\"" + num(y) + "\" width=\"" + num(width) + "\" height=\"" + num(height) +
         "\" href=\"data:image/png;base64," + base64(png_of(canvas.indices, palette(false, part_class))) + "\"/>";
}

std::string placed(const std::string& svg, double x, double y, double size) {
  return "<svg x=\"" + num(x) + "\" y=\"" + num(y) + "\" width=\"" + num(size) + "\" height=\"" + num(size) + "\"" +
         svg.substr(4);  // after "<svg"
}

std::string card(double x, double y, double width, double height, const std::string& letter,
                 const std::vector<std::string>& caption, const std::string& body) {
  std::string out = "<rect class=\"card\" rx=\"8\" x=\"" + num(x) + "\" y=\"" + num(y) + "\" width=\"" + num(width) +
                    "\" height=\"" + num(height) + "\"/>" + body;
  for (std::size_t i = 0; i < caption.size(); ++i)
    out += "<text class=\"cap\" x=\"" + num(x + 12) + "\" y=\"" +
           num(y + height - 12 - 18.0 * static_cast<double>(caption.size() - 1 - i)) + "\">" +
           (i == 0 && !letter.empty() ? "<tspan class=\"letter\">" + letter + "</tspan>\u2002" : "") +
           escaped(caption[i]) + "</text>";
  return out;
}

std::string figure_file(int width, int height, const std::string& title, const std::string& body) {
  std::string style = kFigureStyle;
  for (int i = 0; i < kVoteColours; ++i)
    style += ".m" + std::to_string(i) + "{stroke:" + hex(magma(0.88 - 0.80 * i / (kVoteColours - 1.0))) + "}";
  const std::string size = std::to_string(width) + " " + std::to_string(height);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + size + "\" width=\"" + std::to_string(width) +
         "\" height=\"" + std::to_string(height) + "\" role=\"img\"><title>" + escaped(title) + "</title><style>" +
         style + "</style><rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n" + body + "\n</svg>\n";
}

}  // namespace tribin::report
