// CGAL's Efficient RANSAC (Schnabel et al. 2007), planes and cylinders: the most accurate peer for segmentation.
// It is given true normals and no background.

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Shape_detection/Efficient_RANSAC.h>
#include <CGAL/property_map.h>

#include <cmath>
#include <tuple>

#include "peer_io.hpp"

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
// It reorders its input: every point carries its pixel.
using Point = std::tuple<Kernel::Point_3, Kernel::Vector_3, std::size_t>;
using Points = std::vector<Point>;
using Traits = CGAL::Shape_detection::Efficient_RANSAC_traits<Kernel, Points, CGAL::Nth_of_tuple_property_map<0, Point>,
                                                              CGAL::Nth_of_tuple_property_map<1, Point>>;
using Ransac = CGAL::Shape_detection::Efficient_RANSAC<Traits>;
using Plane = CGAL::Shape_detection::Plane<Traits>;
using Cylinder = CGAL::Shape_detection::Cylinder<Traits>;

}  // namespace

int main(int argc, char** argv) {
  const peer::Request r = peer::read_request(argc, argv);
  const std::size_t pixels = static_cast<std::size_t>(r.width) * r.height;
  const std::vector<float> raw = peer::read_floats(r.cloud, 6 * pixels);
  Points points;
  double pitch = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* p = raw.data() + 6 * i;
    if (!std::isfinite(p[2])) continue;
    points.emplace_back(Kernel::Point_3(p[0], p[1], p[2]), Kernel::Vector_3(p[3], p[4], p[5]), i);
    pitch += p[2] / r.fx;
  }
  if (points.empty()) return 4;
  pitch /= static_cast<double>(points.size());
  CGAL::get_default_random() = CGAL::Random(1);  // it seeds by the clock
  std::srand(1);
  Ransac ransac;
  Ransac::Parameters parameters;
  parameters.probability = 0.01;
  parameters.min_points = 1000;
  parameters.epsilon = 0.35;               // mm: three sigma of the noise and of the facets
  parameters.cluster_epsilon = 3 * pitch;  // mm
  parameters.normal_threshold = 0.95;
  const peer::Stopwatch watch;
  ransac.set_input(points);
  ransac.add_shape_factory<Plane>();
  ransac.add_shape_factory<Cylinder>();
  ransac.detect(parameters);
  watch.report();
  std::vector<int> labels(pixels, 0);
  int id = 0;
  for (const auto& shape : ransac.shapes()) {
    ++id;
    const bool cylinder = dynamic_cast<const Cylinder*>(shape.get()) != nullptr;
    for (const std::size_t k : shape->indices_of_assigned_points())
      labels[std::get<2>(points[k])] = id | (cylinder ? peer::kCylinderBit : 0);
  }
  peer::write_raw(r.out, labels);
}
