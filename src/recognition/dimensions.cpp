#include <algorithm>
#include <cmath>
#include <functional>

#include "metrology.hpp"
#include "tolerances.hpp"

namespace tribin {
namespace {

using Value = std::function<double(const Primitive&, const Primitive&)>;

bool has_axis(const Primitive& p) { return p.type == PrimitiveType::cylinder || p.type == PrimitiveType::cone; }

/// The longest straight edge that an angle of this surface is seen along [mm].
double leg_of(const Primitive& p) {
  return has_axis(p) ? std::max(p.height_mm(), 2 * p.radius_mm) : std::sqrt(std::max(0.0, p.area_mm2));
}

/// Unsigned angle between two axes [rad].
double angle_between(const Primitive& a, const Primitive& b) {
  const Eigen::Vector3d x = a.axis, y = b.axis;
  return std::atan2(x.cross(y).norm(), std::abs(x.dot(y)));
}

/// Of b's point from the plane a.
double from_plane(const Primitive& a, const Primitive& b) { return (b.point - a.point).dot(a.axis); }

/// Of b's point from the axis of a.
double from_axis(const Primitive& a, const Primitive& b) {
  const Eigen::Vector3d d = b.point - a.point, axis = a.axis;
  return (d - axis * axis.dot(d)).norm();
}

/// The value with the sd that both fits leave it: numerical derivatives by their parameters. Systematic terms move both
/// at once.
double sigma_of(const Value& value, const FreeFit& a, const FreeFit& b, const SystematicVariances& systematic) {
  constexpr double kStep = 1e-5;  // mm or rad: far below what is measured, far above rounding
  const double at = value(a.measured, b.measured);
  Eigen::Matrix<double, 1, 6> ga, gb;
  for (int k = 0; k < 6; ++k) {
    ga[k] = (value(nudged(a.measured, k, kStep), b.measured) - at) / kStep;
    gb[k] = (value(a.measured, nudged(b.measured, k, kStep)) - at) / kStep;
  }
  const Eigen::Matrix<double, 6, 6> ca = a.covariance, cb = b.covariance;
  const Eigen::Matrix<double, 1, kSystematicTerms> common = ga * a.response + gb * b.response;
  return std::sqrt(std::max(
      0.0, (ga * ca * ga.transpose() + gb * cb * gb.transpose() + common * systematic.asDiagonal() * common.transpose())
               .value()));
}

struct Table {
  const SystematicVariances& systematic;
  std::vector<Dimension> out;

  void add(const char* kind, const MeasuredPrimitive& a, const MeasuredPrimitive* b, const Value& value,
           double tolerance, bool is_angle = false) {
    // What a lone primitive says of itself is of the first one; the other takes no part.
    FreeFit none;
    none.response.setZero();
    const FreeFit& second = b ? b->fit : none;
    Dimension d;
    const auto named = [](const Primitive& p) { return std::string(name_of(p.type)) + " " + std::to_string(p.id); };
    d.name = named(a.nominal) + (b ? " to " + named(b->nominal) : "") + ": " + kind;
    std::replace(d.name.begin(), d.name.end(), '_', ' ');
    d.kind = kind;
    d.first = a.nominal.id;
    d.second = b ? b->nominal.id : 0;
    d.nominal = value(a.nominal, b ? b->nominal : none.measured);
    d.measured = value(a.fit.measured, second.measured);
    d.sigma = sigma_of(value, a.fit, second, systematic);
    d.tolerance = tolerance;
    d.is_angle = is_angle;
    if (!(d.sigma < tolerance)) return;
    d.deviates = std::abs(d.measured - d.nominal) > tolerance + 3 * d.sigma;
    out.push_back(std::move(d));
  }
};

void add_own(Table& table, const MeasuredPrimitive& m) {
  const Primitive& p = m.nominal;
  if (p.type == PrimitiveType::sphere || (p.type == PrimitiveType::cylinder && !m.fit.measured.radius_from_cad))
    table.add(
        "radius", m, nullptr, [](const Primitive& a, const Primitive&) { return a.radius_mm; },
        p.fillet ? fillet_tolerance_mm(p.radius_mm) : 0.5 * length_tolerance_mm(2 * p.radius_mm));
  if (p.type == PrimitiveType::cone && m.fit.measured.arc >= kLeastArc)
    table.add(
        "half_angle", m, nullptr, [](const Primitive& a, const Primitive&) { return a.half_angle; },
        angle_tolerance(leg_of(p)), true);
}

void add_pair(Table& table, const MeasuredPrimitive& a, const MeasuredPrimitive& b) {
  const Primitive &p = a.nominal, &q = b.nominal;
  const double angle = angle_between(p, q);
  const bool parallel = angle<1 * kDegree, across = angle> 89 * kDegree;
  const double angle_limit = angle_tolerance(std::min(leg_of(p), leg_of(q)));
  table.add("angle", a, &b, angle_between, angle_limit, true);
  if (p.type == PrimitiveType::plane && q.type == PrimitiveType::plane) {
    if (parallel) table.add("distance", a, &b, from_plane, length_tolerance_mm(std::abs(from_plane(p, q))));
  } else if (has_axis(p) && has_axis(q)) {
    // The apex of a cone is too far away to be a place on its axis.
    if (!parallel || p.type == PrimitiveType::cone || q.type == PrimitiveType::cone) return;
    const double distance = from_axis(p, q);
    const bool coaxial = distance < kCoaxialityMm;
    // From the axis whose direction is told better: the other's place is looked at only.
    const auto tilt = [](const MeasuredPrimitive& m) { return m.fit.covariance(0, 0) + m.fit.covariance(1, 1); };
    const bool turn = tilt(b) < tilt(a);
    table.add(coaxial ? "coaxiality" : "distance", turn ? b : a, turn ? &a : &b, from_axis,
              coaxial ? kCoaxialityMm : length_tolerance_mm(distance));
  } else if (p.type == PrimitiveType::plane && q.type == PrimitiveType::cylinder) {
    if (across) table.add("distance", a, &b, from_plane, length_tolerance_mm(std::abs(from_plane(p, q))));
  }
}

/// A surface that says where something is: not what only rounds an edge off, and with an axis that is told.
bool is_datum(const MeasuredPrimitive& m) {
  if (m.nominal.fillet || m.nominal.type == PrimitiveType::sphere) return false;
  return m.nominal.type == PrimitiveType::plane || m.fit.measured.arc >= kLeastArc;
}

}  // namespace

std::vector<Dimension> measure_dimensions(std::span<const MeasuredPrimitive> measured,
                                          const SystematicVariances& systematic) {
  constexpr int kLeastPatches = 12;  // fewer tell no sigma of their own
  Table table{systematic, {}};
  std::vector<const MeasuredPrimitive*> sure;
  // In a shiny hollow light goes to and fro: it counts where a quarter of it is seen and fits a surface.
  constexpr double kHollowArc = kPi / 2, kHollowRms = 1.5;
  for (const MeasuredPrimitive& m : measured)
    if (m.fit.patches >= kLeastPatches &&
        (!m.mirrored || (m.fit.measured.arc >= kHollowArc && m.fit.rms_sigma <= kHollowRms)))
      sure.push_back(&m);
  for (const MeasuredPrimitive* m : sure) add_own(table, *m);
  for (std::size_t i = 0; i < sure.size(); ++i)
    for (std::size_t k = i + 1; k < sure.size(); ++k) {
      if (!is_datum(*sure[i]) || !is_datum(*sure[k])) continue;
      const bool plane_first = has_axis(sure[i]->nominal) && sure[k]->nominal.type == PrimitiveType::plane;
      add_pair(table, *sure[plane_first ? k : i], *sure[plane_first ? i : k]);
    }
  // What deviates, most against its limit first; then what is told best.
  const auto excess = [](const Dimension& d) { return std::abs(d.measured - d.nominal) / (d.tolerance + 3 * d.sigma); };
  std::vector<Dimension>& all = table.out;
  std::stable_sort(all.begin(), all.end(), [&](const Dimension& a, const Dimension& b) {
    if (a.deviates != b.deviates) return a.deviates;
    if (a.deviates) return excess(a) > excess(b);
    if ((a.second == 0) != (b.second == 0)) return a.second == 0;
    return a.sigma / a.tolerance < b.sigma / b.tolerance;
  });
  constexpr std::size_t kAgreeing = 24;  // a list for people; more of them say nothing new
  const auto first = std::find_if(all.begin(), all.end(), [](const Dimension& d) { return !d.deviates; });
  if (static_cast<std::size_t>(all.end() - first) > kAgreeing) all.erase(first + kAgreeing, all.end());
  return std::move(table.out);
}

}  // namespace tribin
