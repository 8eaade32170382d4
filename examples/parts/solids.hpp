#pragma once

#include <TopoDS_Shape.hxx>
#include <vector>

// Building blocks of turned and cast parts, in mm and degrees; the axis of the part is z.
namespace parts {

/// A corner of a turned profile.
struct Corner {
  double r = 0;
  double z = 0;
  double fillet = 0;  ///< radius of the rounding; 0 = sharp
};

/// The solid that a closed profile sweeps about z.
TopoDS_Shape turned(const std::vector<Corner>& profile);

/// A cylinder along z at (x, y).
TopoDS_Shape rod(double x, double y, double radius, double z0, double z1);

/// A hexagon along z at (x, y), `across` its flats.
TopoDS_Shape hexagon(double x, double y, double across, double z0, double z1);

/// A box from min to max, turned about z.
TopoDS_Shape block(double angle, double x0, double x1, double y0, double y1, double z0, double z1);

/// A mounting ear: a plate in the direction `angle`, from a half width at the axis to a boss of `radius` at
/// `distance`, its rims rounded.
TopoDS_Shape ear(double angle, double distance, double radius, double base_half, double z0, double z1);

/// A piece of a ring, for fan windows.
TopoDS_Shape ring_sector(double angle, double width_angle, double r0, double r1, double z0, double z1);

TopoDS_Shape fused(const TopoDS_Shape& body, const std::vector<TopoDS_Shape>& more);
TopoDS_Shape cut(const TopoDS_Shape& body, const std::vector<TopoDS_Shape>& tools);

/// (x, y) of a place given by its angle about z and its distance from it.
struct Place {
  double x = 0, y = 0;
};
Place polar(double angle, double distance);

}  // namespace parts
