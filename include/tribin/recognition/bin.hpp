#pragma once

#include <optional>
#include <string>

#include "tribin/cad/mesh.hpp"
#include "tribin/model/primitive_model.hpp"

/// The bin as a known object: found in the scan, taken out of it by its model, and how full it is.
namespace tribin {

/// An open box. Its frame: origin on the inner floor's middle, x along the first inner side, z up.
struct BinShape {
  Vec3 inner_size_mm = Vec3::Zero();  ///< length, width, height; > 0
  double wall_mm = 8;                 ///< of walls and floor; > 0
};

/// The box as a closed mesh.
Mesh bin_mesh(const BinShape& shape);

/// What is known of the bin before the scan is looked at.
struct KnownBin {
  BinShape shape;
  std::optional<Pose> camera_from_bin;  ///< none = it is sought in the whole scan
  double sigma_mm = 0;                  ///< sd of the camera's place against what the bin stands on; 0 = not said
  double sigma_rad = 0;                 ///< of its rotation; 0 = not said
};

/// Where the scan shows the bin.
struct BinSighting {
  BinShape shape;
  bool found = false;
  std::string reason;  ///< why it is not found; empty when it is
  Pose camera_from_bin = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< of the fit alone, as Instance::covariance
  double tolerance_mm = 0;               ///< what is measured on the bin lies within this of its model
  /// How far the bin had to move from where it was said to stand, in sigmas of what is known (Mahalanobis distance over
  /// six directions). None where its place was not given.
  std::optional<double> drift_sigma;
  double drift_mm = 0;   ///< the same motion: of the middle of the inner volume
  double drift_rad = 0;  ///< and the rotation
  double fill = 0;       ///< share of the inner volume below the seen surfaces, 0 to 1
};

/// Beyond this many sigmas the bin is not where hand-eye and cell say: one right cell in 10,000 goes over it by chance
/// (chi-square of six degrees of freedom, 28).
inline constexpr double kDriftLimit = 5.3;

/// Seeks the bin: from its given place, and by its rim; what the scan shows best is refined on walls, floor, rim and
/// outline. Of the turns that leave the box as it is, the nearest to the given place, or else the one whose x looks
/// most along the camera's, is told.
/// \param observation  of the scan; its planes say which way is up.
/// \cost 50 to 300 ms at 1.3 Mpx; most for the search.
/// \source ours (docs/bin.md).
BinSighting find_bin(const KnownBin& known, const Surfels& surfels, const PrimitiveModel& observation);

/// Which cells of the scan (Surfels::surfel_of_cell) something inside of the bin may show in: 1 above the floor, off
/// the walls, or over the rim; 0 for the bin itself and all around it.
Image<std::uint8_t> cells_inside(const BinSighting& bin, const Surfels& surfels);

/// Share of the inner volume that lies below what the camera sees, in upright columns. A column's height is the mean of
/// the points in it; one that no point falls into (hidden, not measured, or along a wall) takes the mean of its
/// neighbours, from the rims of such gaps inwards.
/// \return 0 (empty) to 1; within the noise of the fit of the floor.
double fill_of(const BinSighting& bin, const Scan& scan);

}  // namespace tribin
