#include "tolerances.hpp"

#include <array>

#include "tribin/core/geometry.hpp"

namespace tribin {
namespace {

struct Row {
  double up_to = 0, value = 0;
};

template <std::size_t N>
double look_up_row(const std::array<Row, N>& table, double size) {
  for (const Row& row : table)
    if (size <= row.up_to) return row.value;
  return table.back().value;
}

}  // namespace

double length_tolerance_mm(double nominal_mm) {
  constexpr std::array<Row, 7> kTable = {
      {{6, 0.1}, {30, 0.2}, {120, 0.3}, {400, 0.5}, {1000, 0.8}, {2000, 1.2}, {4000, 2.0}}};
  return look_up_row(kTable, nominal_mm);
}

double fillet_tolerance_mm(double radius_mm) {
  constexpr std::array<Row, 3> kTable = {{{3, 0.2}, {6, 0.5}, {1e9, 1.0}}};
  return look_up_row(kTable, radius_mm);
}

double angle_tolerance(double leg_mm) {
  constexpr std::array<Row, 5> kTable = {{{10, 60}, {50, 30}, {120, 20}, {400, 10}, {1e9, 5}}};  // minutes
  return look_up_row(kTable, leg_mm) / 60 * kDegree;
}

double form_tolerance_mm(double extent_mm) {
  constexpr std::array<Row, 6> kTable = {{{10, 0.05}, {30, 0.1}, {100, 0.2}, {300, 0.4}, {1000, 0.6}, {3000, 0.8}}};
  return look_up_row(kTable, extent_mm);
}

}  // namespace tribin
