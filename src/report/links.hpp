#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tribin/core/image.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin::report {

// "Everything points at everything": what shows one primitive carries one key, whatever the picture; the page's script
// lights all of one key together. A primitive of the scan and its partner in the CAD have the scan's key.

std::string scan_key(int primitive_id);
std::string cad_key(int part_class, int primitive_id);
/// ` data-k="s3 s7"`, or nothing without keys.
std::string link_to(const std::vector<std::string>& keys);

/// What a region of a picture shows.
struct Region {
  std::string key, title;
};
/// A transparent layer over a picture: the outline of each region of equal id, on a grid of 2 pixels.
/// \param ids  0 = nothing. \param region_of  of an id; an empty key leaves it out.
std::string region_layer(const Image<std::uint16_t>& ids, const std::function<Region(int id)>& region_of);

/// Lights the keys under the pointer or the one that was clicked (Esc lets go), and shows one part's pictures at a
/// time. Without scripts the page shows all.
std::string link_script();

}  // namespace tribin::report
