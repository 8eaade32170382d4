#pragma once

#include "report/pictures.hpp"
#include "report/sighting.hpp"

namespace tribin::report {

/// The pictures (a) to (d) of the paper's figures 4 and 5, as SVG of 200 x 200.
struct SpaceArt {
  std::string all;     ///< (a) IJK space of all surfels
  std::string flat;    ///< (b) of the flat ones, peaks of planes ringed
  std::string curved;  ///< (c) of the curved ones, with the circles of cylinders and cones
  std::string votes;   ///< (d) parameter space
};
SpaceArt space_art(const Observation& seen, const Sighting& where);

}  // namespace tribin::report
