#pragma once

#include <TopoDS_Shape.hxx>

// Two car alternators, alike in size, as they come mixed in one bin. Frame: z along the shaft, towards the pulley; the
// rear cover's back lies at z = 0.
//
// What tells them apart, by the side that is up:
//   lying        pulley (six ribs, R 28 / two V grooves, R 34), steps of the barrel (the stator stands out / lies
//   back),
//                adjusting ears (one / two), slots of the walls (15 in two rows / 8 in one)
//   on the rear  front windows (10 / 6), pulley, ears, collar of the front face
//   on the nose  rear cover (flat with 6 rays / conical with 5 round holes), connector, tie bolts (4 / 3)
namespace parts {

TopoDS_Shape alternator_a();
TopoDS_Shape alternator_b();

/// A small starter battery, to lie among them. z up from the foot, x along its length; the terminals tell the ends.
TopoDS_Shape battery();

}  // namespace parts
