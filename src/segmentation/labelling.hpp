#pragma once

#include "segmentation/region.hpp"

namespace tribin::segmentation_detail {

/// A surface with what it costs to have it at all.
struct Model {
  Surface surface;
  double cost = 0;         ///< nats
  bool axis_held = false;  ///< fits keep its direction
};

/// Every point gives its vote to one model or to none, so that the whole costs least: squared distances in sigmas,
/// neighbours of different models, and the models themselves (in nats, so that all of it is one code length).
/// \source Isack and Boykov, Energy-based geometric multi-model fitting, 2012; Delong et al., Fast approximate energy
///         minimization with label costs, 2012.
struct Labelling {
  static constexpr double kReach = 3.0;  ///< sigmas: beyond, being unexplained is cheaper
  static constexpr double kUnexplained = 0.5 * kReach * kReach;

  const Surfels& surfels;
  double precision = 1;              ///< of the points, against the surfels' sigmas: one over the square of their ratio
  double edge = 0;                   ///< nats for each pair of neighbours that are of different models
  std::vector<Model> models;         ///< those that lost all their points stay, so that labels hold
  std::vector<std::int32_t> label;   ///< per surfel: index of its model; -1 = unexplained
  std::vector<double> misfit;        ///< per surfel: what its place costs under its label
  std::vector<std::uint32_t> count;  ///< points of each model

  Labelling(const Surfels& s, double edge_cost);
  std::vector<Indices> supports() const;
  /// Puts another surface in place of a model's, as a fit to its points, and weighs them anew.
  void replace(std::size_t model, const Model& by);
  double energy() const;
  /// Half the squared distance of a surfel in sigmas.
  double place_cost(std::uint32_t i, const Surface& surface) const;

 private:
  friend double expand(Labelling&, const Model&, std::span<const std::uint32_t>, std::int32_t);
  std::vector<std::int32_t> place_;  ///< scratch: node of a surfel, -1 elsewhere
};

/// Offers a model to the points that lie on it and hang together with `from`: those take it whose taking it makes the
/// whole cheapest, models that lose all their points for it included. Nothing changes where the whole gets no cheaper.
/// \param as  the model's index, if it is one of the labelling; -1 = it is new.
/// \return    what was saved [nats], >= 0.
double expand(Labelling& labelling, const Model& model, std::span<const std::uint32_t> from, std::int32_t as = -1);

}  // namespace tribin::segmentation_detail
