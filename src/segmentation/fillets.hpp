#pragma once

#include "tribin/segmentation/primitives.hpp"

namespace tribin::segmentation_detail {

/// Sets Primitive::fillet: cylinders of less than 130 deg, and tori, that go over into other primitives without an
/// edge on both sides across their bend. The bend of a pipe, whose ends do so, is none.
/// \cost  one look at each pair of neighbouring surfels.
void mark_fillets(Primitives& primitives, const Surfels& surfels);

}  // namespace tribin::segmentation_detail
