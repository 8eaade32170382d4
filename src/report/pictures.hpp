#pragma once

#include <span>
#include <string>

#include "tribin/finder/finder.hpp"

namespace tribin::report {

/// What the pictures need of a scan.
struct Observation {
  const Scan& scan;
  const Surfels& surfels;
  const Primitives& primitives;
};

/// The scan from the camera's eye with the outline of each instance in its class's colour.
std::string overview(const Observation& seen, std::span<const Part> parts, const std::vector<Instance>& instances);

/// The ten pictures of the paper's figures 4 and 5, as figures of the page, for one part.
/// \param instance  null when the part was not found: then only the CAD's two can be shown.
/// \param size_px   of the square pictures.
std::string ten_pictures(const Observation& seen, const Part& part, const Instance* instance, int part_class,
                         int size_px);

/// The seven pictures that need no part: spaces, cloud, segmentation, model.
std::string scan_pictures(const Observation& seen, int size_px);

/// The same of loose points: the spaces, and the segmentation as a disc for each point.
std::string cloud_pictures(const Surfels& surfels, const Primitives& primitives, int size_px);

/// The two pictures that need no scan: CAD, and the model made from it.
std::string part_pictures(const Part& part, int part_class, int size_px);

/// The legend under the pictures.
std::string picture_legend();

}  // namespace tribin::report
