#include <algorithm>
#include <cmath>
#include <limits>

#include "tribin/capture/decode.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

double noise_of(const Decoded& d) { return d.column.empty() ? d.row_noise : d.column_noise; }

/// The weighted mean of one pixel's coordinate; false where two exposures contradict each other.
bool merge_pixel(std::span<const Decoded> exposures, Image<float> Decoded::*axis, double Decoded::*noise, std::size_t i,
                 float& out) {
  double sum = 0, weight = 0, first = 0, first_sigma = 0;
  for (const Decoded& e : exposures) {
    const double x = (e.*axis).data[i];
    if (!std::isfinite(x)) continue;
    const double sigma = e.*noise / std::max<double>(1, e.modulation.data[i]), w = 1 / (sigma * sigma);
    if (weight == 0) {
      first = x, first_sigma = sigma;
    } else if (std::abs(x - first) > 5 * std::hypot(sigma, first_sigma)) {
      return false;
    }
    sum += w * x, weight += w;
  }
  out = weight > 0 ? static_cast<float>(sum / weight) : std::numeric_limits<float>::quiet_NaN();
  return true;
}

}  // namespace

Decoded merge_exposures(std::span<const Decoded> exposures) {
  TRIBIN_ASSERT(!exposures.empty());
  Decoded out = exposures.front();
  for (const Decoded& e : exposures)
    TRIBIN_ASSERT(e.width() == out.width() && e.height() == out.height() && e.column.size() == out.column.size() &&
                  e.row.size() == out.row.size());
  // The merged modulation is the one whose noise the weighted mean has: noise^-2 adds up, so M^2 does.
  parallel_ranges(out.height(), 32, [&](int begin, int end) {
    for (std::size_t i = out.invalid_reason.index(0, begin); i < out.invalid_reason.index(0, end); ++i) {
      double power = 0;
      Invalid why = Invalid::measured;
      std::uint8_t dark = 0;
      for (const Decoded& e : exposures) {
        const auto reason = static_cast<Invalid>(e.invalid_reason.data[i]);
        dark = std::max(dark, e.modulation.data[i]);
        if (reason == Invalid::measured)
          power += std::pow(e.modulation.data[i] / noise_of(e) * noise_of(out), 2);
        else if (why == Invalid::measured || why == Invalid::dark)
          why = reason;  // anything says more than dark
      }
      if (power > 0) why = Invalid::measured;
      out.modulation.data[i] = power > 0 ? static_cast<std::uint8_t>(std::min(255.0, std::sqrt(power) + 0.5)) : dark;
      const float none = std::numeric_limits<float>::quiet_NaN();
      bool good = true;
      if (!out.column.empty())
        good = merge_pixel(exposures, &Decoded::column, &Decoded::column_noise, i, out.column.data[i]);
      if (!out.row.empty() && !merge_pixel(exposures, &Decoded::row, &Decoded::row_noise, i, out.row.data[i])) {
        out.row.data[i] = none;
        good = good && !out.column.empty();
      }
      if (!good) {
        why = Invalid::order_inconsistent;
        if (!out.column.empty()) out.column.data[i] = none;
      }
      out.invalid_reason.data[i] = static_cast<std::uint8_t>(why);
    }
  });
  return out;
}

}  // namespace tribin
