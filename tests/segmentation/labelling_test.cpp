#include "segmentation/labelling.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "segmentation/min_cut.hpp"

namespace tribin::segmentation_detail {
namespace {

TEST(MinCut, CostsNoMoreThanAnyOtherCut) {
  constexpr std::uint32_t kNodes = 9;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> cost(-5, 5);
    struct Edge {
      std::uint32_t a, b;
      double cost;
    };
    std::vector<std::array<double, 2>> node(kNodes);
    std::vector<Edge> edges;
    MinCut cut(kNodes);
    for (std::uint32_t i = 0; i < kNodes; ++i) {
      node[i] = {cost(random), cost(random)};
      cut.add_node(i, node[i][0], node[i][1]);
      for (std::uint32_t j = 0; j < kNodes; ++j)
        if (j != i && random() % 3 == 0) {
          edges.push_back({i, j, std::abs(cost(random))});
          cut.add_edge(i, j, edges.back().cost);
        }
    }
    const auto price = [&](std::uint32_t sides) {
      double sum = 0;
      for (std::uint32_t i = 0; i < kNodes; ++i) sum += node[i][(sides >> i) & 1u];
      for (const Edge& e : edges)
        if (((sides >> e.a) & 1u) == 0 && ((sides >> e.b) & 1u) == 1) sum += e.cost;
      return sum;
    };
    std::uint32_t found = 0;
    const std::vector<std::uint8_t> second = cut.solve();
    for (std::uint32_t i = 0; i < kNodes; ++i) found |= static_cast<std::uint32_t>(second[i]) << i;
    double least = HUGE_VAL;
    for (std::uint32_t sides = 0; sides < (1u << kNodes); ++sides) least = std::min(least, price(sides));
    EXPECT_NEAR(price(found), least, 1e-6);
  }
}

/// Points at random near a few parallel planes, each joined to some others.
Surfels stack(std::mt19937& random, std::uint32_t count) {
  std::normal_distribution<double> noise(0, 1);
  Surfels s;
  std::vector<std::vector<std::uint32_t>> near(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    s.position.push_back(Vec3(noise(random), noise(random), 3.0 * (random() % 3) + noise(random)).cast<float>());
    s.sigma_mm.push_back(1.0f);
    for (std::uint32_t j = 0; j < i; ++j)
      if (random() % 4 == 0) {
        near[i].push_back(j);
        near[j].push_back(i);
      }
  }
  s.neighbour_begin.push_back(0);
  for (const auto& list : near) {
    s.neighbours.insert(s.neighbours.end(), list.begin(), list.end());
    s.neighbour_begin.push_back(static_cast<std::uint32_t>(s.neighbours.size()));
  }
  return s;
}

TEST(Labelling, AnOfferSavesWhatItSaysAndNeverCosts) {
  int taken = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const Surfels s = stack(random, 30);
    Labelling l(s, 0.3);
    for (int offer = 0; offer < 12; ++offer) {
      Model model;
      model.surface.point = Vec3(0, 0, 1.5 * (random() % 6));
      model.cost = 4;
      const auto from = static_cast<std::uint32_t>(random() % s.size());
      const std::int32_t as = offer % 3 == 2 && !l.models.empty() ? 0 : -1;
      if (as == 0) model = l.models[0];
      const double before = l.energy();
      const double saved = expand(l, model, std::span(&from, 1), as);
      EXPECT_GE(saved, 0);
      EXPECT_NEAR(l.energy(), before - saved, 1e-9);
      taken += saved > 0;
      std::vector<std::uint32_t> count(l.models.size(), 0);
      for (std::int32_t label : l.label)
        if (label >= 0) ++count[static_cast<std::size_t>(label)];
      EXPECT_EQ(count, l.count);
    }
  }
  EXPECT_GT(taken, 150);
}

/// What a new model takes from a few points is the best of all that it could take.
TEST(Labelling, AnOfferIsTakenByTheBestSetOfPoints) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const Surfels s = stack(random, 10);
    Indices all(s.size());
    for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    Labelling l(s, 0.3);
    for (double z : {0.0, 3.0}) {
      Model model;
      model.surface.point = Vec3(0, 0, z);
      model.cost = 2;
      expand(l, model, all);
    }
    Model model;
    model.surface.point = Vec3(0, 0, 1.5);
    model.cost = 2;
    double least = l.energy();
    for (std::uint32_t set = 1; set < (1u << s.size()); ++set) {
      Labelling trial = l;
      trial.models.push_back(model);
      trial.count.push_back(0);
      for (std::uint32_t i = 0; i < s.size(); ++i) {
        if (((set >> i) & 1u) == 0) continue;
        if (trial.label[i] >= 0) --trial.count[static_cast<std::size_t>(trial.label[i])];
        trial.label[i] = static_cast<std::int32_t>(trial.models.size() - 1);
        trial.misfit[i] = std::min(Labelling::kUnexplained, trial.place_cost(i, model.surface));
        ++trial.count.back();
      }
      least = std::min(least, trial.energy());
    }
    expand(l, model, all);
    EXPECT_NEAR(l.energy(), least, 1e-6);
  }
}

}  // namespace
}  // namespace tribin::segmentation_detail
