#include <algorithm>
#include <cmath>
#include <cstdio>

#include "report/html.hpp"
#include "report/sketch.hpp"
#include "report/solids.hpp"
#include "report/space_art.hpp"
#include "tribin/report/summary.hpp"

namespace tribin::report {
namespace {

std::string flow(double x0, double y0, double x1, double y1) {
  char out[256];
  const bool down = y1 - y0 > 20 || y0 - y1 > 20;
  if (down)
    std::snprintf(out, sizeof out,
                  "<path class=\"flow\" d=\"M%.0f %.0fH%.0fV%.0fH%.0f\"/><path class=\"flow-head\" d=\"M%.0f "
                  "%.0fl-9-4.500v9z\"/>",
                  x0, y0, 0.5 * (x0 + x1), y1, x1 - 8, x1, y1);
  else
    std::snprintf(
        out, sizeof out,
        "<path class=\"flow\" d=\"M%.0f %.0fH%.0f\"/><path class=\"flow-head\" d=\"M%.0f %.0fl-9-4.500v9z\"/>", x0, y0,
        x1 - 8, x1, y1);
  return out;
}

/// What the model of a part is, in words: how many, and the largest cylinders with radius and height.
std::string model_words(const Part& part, double x, double y) {
  int planes = 0;
  std::vector<const Primitive*> cylinders;
  for (const Primitive& p : part.model.primitives) {
    planes += p.type == PrimitiveType::plane;
    if (p.type == PrimitiveType::cylinder && !p.concave) cylinders.push_back(&p);
  }
  std::vector<std::string> lines = {std::to_string(part.model.primitives.size()) + " primitives",
                                    std::to_string(planes) + " planes",
                                    std::to_string(cylinders.size()) + " convex cylinders"};
  std::stable_sort(cylinders.begin(), cylinders.end(),
                   [](const Primitive* a, const Primitive* b) { return a->area_mm2 > b->area_mm2; });
  std::vector<double> radii;
  for (const Primitive* c : cylinders) {
    if (radii.size() == 5) break;
    if (std::any_of(radii.begin(), radii.end(), [&](double r) { return std::abs(r - c->radius_mm) < 0.1; })) continue;
    radii.push_back(c->radius_mm);
    lines.push_back("cylinder  r " + number(c->radius_mm, 1) + "  h " + number(c->height_mm(), 1) + " mm");
  }
  std::string out;
  for (std::size_t i = 0; i < lines.size(); ++i)
    out += "<text class=\"" + std::string(i == 0 ? "title" : "small") + "\" x=\"" + number(x, 0) + "\" y=\"" +
           number(y + 20.0 * static_cast<double>(i) + (i > 2 ? 8 : 0), 0) + "\">" + lines[i] + "</text>";
  return out;
}

}  // namespace

std::string figure_overview(const Scan& scan, const Part& part, int part_class, const Found& found,
                            const Instance& instance) {
  constexpr double kWide = 196, kTall = 252, kStep = 236, kTop = 16, kLow = 300, kPicture = 180;
  const Observation seen{scan, found.surfels, found.primitives};
  const Pose& pose = instance.camera_from_part;
  const Sighting where = sighting_of(scan, found.surfels, found.primitives, part, pose);
  const View view = view_of(part.mesh.vertices, pose, 300);
  const ScanCanvases drawn = scan_canvases(seen, where, view);
  const CadCanvases cad = cad_canvases(part, pose, view);
  const SpaceArt art = space_art(seen, where);
  const auto x_of = [&](int column) { return 16 + column * kStep; };
  const auto picture = [&](const Canvas& canvas, int column, double top) {
    return image_svg(canvas, part_class, x_of(column) + 8, top + 8, kPicture);
  };
  std::string out;
  out += card(x_of(0), kTop, kWide, kTall, "1", {"Scan: structured light,", "cloud by height"},
              picture(drawn.scan, 0, kTop));
  out += card(x_of(1), kTop, kWide, kTall, "2", {"Surface normals,", "in IJK space"},
              placed(art.all, x_of(1) + 8, kTop + 8, kPicture));
  out += card(x_of(2), kTop, kWide, kTall, "3", {"Segmentation: planes,", "cylinders, cones"},
              picture(drawn.segmentation, 2, kTop));
  out += card(x_of(3), kTop, kWide, kTall, "4", {"Object modelling:", "the observation"},
              picture(drawn.observed, 3, kTop));
  out += card(x_of(1), kLow, kWide, kTall, "", {"CAD: STEP, DXF, IGES,", "STL, OBJ, PLY"}, picture(cad.cad, 1, kLow));
  out += card(x_of(2), kLow, kWide, kTall, "", {"The same segmentation,", "triangles weighted by area"},
              picture(cad.model, 2, kLow));
  out += card(x_of(3), kLow, kWide, kTall, "", {"The model: radii, heights,", "relations, symmetry"},
              model_words(part, x_of(3) + 16, kLow + 34));
  const double middle = 158;
  out += card(x_of(4), middle, kWide + 16, kTall, "5", {"Recognition and pose:", "CAD outline on the scan"},
              image_svg(pose_canvas(seen, where, part, pose, view), part_class, x_of(4) + 16, middle + 8, kPicture));
  for (int k = 0; k < 3; ++k) out += flow(x_of(k) + kWide + 4, kTop + 110, x_of(k + 1) - 4, kTop + 110);
  for (int k = 1; k < 3; ++k) out += flow(x_of(k) + kWide + 4, kLow + 110, x_of(k + 1) - 4, kLow + 110);
  out += flow(x_of(3) + kWide + 4, kTop + 110, x_of(4) - 4, middle + 70);
  out += flow(x_of(3) + kWide + 4, kLow + 110, x_of(4) - 4, middle + 150);
  const Vec3 t = pose.translation(), r = yaskawa_angles(Matrix3(pose.linear())) / kDegree;
  const std::string lines[] = {escaped(instance.part),
                               "x " + number(t.x(), 2) + "  y " + number(t.y(), 2) + "  z " + number(t.z(), 2) + " mm",
                               "Rx " + number(r.x(), 2) + "  Ry " + number(r.y(), 2) + "  Rz " + number(r.z(), 2) + "°",
                               "in the camera's frame: to the robot"};
  for (int i = 0; i < 4; ++i)
    out += "<text class=\"" + std::string(i == 0 ? "title" : "small") + "\" x=\"" + number(x_of(4), 0) + "\" y=\"" +
           number(middle + kTall + 24 + 18 * i, 0) + "\">" + lines[i] + "</text>";
  return figure_file(1190, 568, "The chain from scan and CAD to class and pose", out);
}

}  // namespace tribin::report
