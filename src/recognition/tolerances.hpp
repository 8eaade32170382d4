#pragma once

// How far a good part may be from its CAD where nobody says otherwise. A scan that is exact enough sees every part
// differ from its CAD: what counts is whether it differs by more than parts are made to.
namespace tribin {

/// Half width of a length [mm]. \source ISO 2768-1, class m (medium), table 1.
double length_tolerance_mm(double nominal_mm);
/// Half width of a rounded edge's radius [mm]. \source ISO 2768-1, class m, table 2.
double fillet_tolerance_mm(double radius_mm);
/// Half width of an angle [rad]. \source ISO 2768-1, class m, table 3. \param leg_mm  the shorter leg.
double angle_tolerance(double leg_mm);
/// Straightness and flatness [mm] of a surface. \source ISO 2768-2, class K, table 1.
double form_tolerance_mm(double extent_mm);
/// How far axes that are one by the CAD may lie apart [mm]: half of the run-out. \source ISO 2768-2, class K, table 4.
constexpr double kCoaxialityMm = 0.1;

}  // namespace tribin
