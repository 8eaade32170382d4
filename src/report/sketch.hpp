#pragma once

#include <string>
#include <vector>

#include "report/canvas.hpp"
#include "tribin/finder/finder.hpp"

namespace tribin::report {

/// Lines, arrows and words placed in space, as SVG over a picture of the same view.
class Sketch {
 public:
  explicit Sketch(const View& view) : view_(view) {}

  /// \param css  classes of the figure's style.
  void line(const Vec3& from, const Vec3& to, const std::string& css);
  void arrow(const Vec3& from, const Vec3& to, const std::string& css);
  void polygon(const std::vector<Vec3>& corners, const std::string& css);
  void path(const std::vector<Vec3>& points, const std::string& css);
  void circle(const Vec3& center, const Vec3& axis, double radius_mm, const std::string& css);
  void dot(const Vec3& at, double radius_px, const std::string& css);
  /// \param dx, dy  [px] from the place.
  void text(const Vec3& at, double dx, double dy, const std::string& words, const std::string& css);
  const std::string& svg() const { return out_; }
  const View& view() const { return view_; }

 private:
  std::string at(const Vec3& world) const;

  View view_;
  std::string out_;
};

/// The palette picture as an SVG image.
std::string image_svg(const Canvas& canvas, int part_class, double x, double y, double width);

/// Inline SVG of 200 x 200 placed in a figure.
std::string placed(const std::string& svg, double x, double y, double size);

/// A card with its letter and caption lines. \param body  in the figure's coordinates.
std::string card(double x, double y, double width, double height, const std::string& letter,
                 const std::vector<std::string>& caption, const std::string& body);

/// A whole figure as a file.
std::string figure_file(int width, int height, const std::string& title, const std::string& body);

/// The bodies of the files.
std::string figure_overview(const Scan& scan, const Part& part, int part_class, const Found& found,
                            const Instance& instance);
std::string figure_spaces(const Scan& scan, const Part& part, const Found& found, const Instance& instance);
std::string figure_geometry(const Scan& scan, const Part& part, const Found& found, const Instance& instance);

}  // namespace tribin::report
