#pragma once

#include <utility>
#include <vector>

#include "capture/fringe_lanes.hpp"
#include "tribin/capture/decode.hpp"

namespace tribin::capture_detail {

/// One image with its weights in the fit of a sinusoid.
struct PhaseImage {
  int image = 0;
  double shift = 0;
  PhaseWeights weights;
};

/// The phase images of one period.
struct Fringe {
  double period = 0;  ///< [px]
  std::vector<PhaseImage> images;
};

/// One code bit and what it is compared with.
struct BitImage {
  int image = 0;
  int inverse = -1;
};

/// A step of the heterodyne chain: the beat of fringes a and b (b < 0: fringe a itself).
struct Wave {
  int a = 0, b = -1;
  double period = 0;  ///< [px]
};

/// A further frequency of a micro phase shifting set.
struct SingleImage {
  int image = 0;
  double period = 0, shift = 0;
  std::vector<std::pair<float, float>> turns;  ///< cosine and sine of its phase after k fringes of the first frequency
};

/// How the patterns along one axis are decoded: Gray code where `bits` is filled, a chain of beats where `chain` is,
/// a search over the orders where `singles` is.
struct AxisPlan {
  PatternAxis axis = PatternAxis::column;
  std::vector<Fringe> fringes;  ///< finest first; each has >= 3 images
  std::vector<BitImage> bits;   ///< coarsest first
  double words_per_fringe = 1;  ///< 1, 2, 4 ..
  std::vector<Wave> chain;      ///< coarsest first
  std::vector<SingleImage> singles;
  int orders = 0;           ///< of the search
  double noise_factor = 0;  ///< sd of X [px] at modulation 1 and image noise 1
};

struct DecodePlan {
  std::vector<AxisPlan> axes;
  int white = -1, black = -1;
};

/// Sorts patterns into plans. \param name  of the frames, for messages.
/// \throws Error bad_input, saying what is missing in the set.
DecodePlan plan_decoding(const std::vector<Pattern>& patterns, const std::string& name);

}  // namespace tribin::capture_detail
