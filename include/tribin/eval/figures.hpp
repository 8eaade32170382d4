#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tribin/eval/judged.hpp"

namespace tribin::eval {

// The figures that judged results come to. Each has its count and 95 % interval.

/// What holds for a group of results: all, a level, a class.
struct Figures {
  std::string name;
  Share recall_40;                           ///< of the parts that show >= 40 %
  Share recall_70;                           ///< of those that show >= 70 %
  Share false_share;                         ///< of all that is given out
  int verdicts[7] = {};                      ///< answers by Verdict
  Share flips, confusions;                   ///< of all that is given out
  Share undecided;                           ///< right ones with alternatives, of all right ones
  Share withheld;                            ///< parts >= 40 % visible that are listed as uncertain instead
  Share recall_told, withheld_told;          ///< found, and uncertain, of those whose telling feature is in view
  int told = 0;                              ///< false ones whose alternatives hold the truth
  Estimate median_mm, high_mm;               ///< of the found: median and 95 % of the translation error
  Estimate median_deg, high_deg;             ///< of the rotation error
  Estimate bound_ratio_mm, bound_ratio_deg;  ///< median of error / Cramer-Rao bound, of the found that have one
  Estimate bound_rms_mm, bound_rms_deg;      ///< rms of the same: 1 is the best that any estimator can do
};

/// The figures of confidence; they need covariances (NDJSON) but for those of the score.
struct Confidence {
  struct Coverage {
    std::string group;
    Share inside;  ///< right answers whose error lies in the 95 % ellipsoid
  };
  std::vector<Coverage> coverage;  ///< all first, then by level, class and visible share
  Estimate calibration_error;      ///< of the score, in ten bins of equal count
  double calibration_floor = 0;    ///< what a perfect score would show of it by chance at these counts
  struct Bin {
    double score = 0;  ///< mean
    Share right;
  };
  std::vector<Bin> bins;
  /// Found, of the parts that show >= 40 %, by those answers alone that are given out at 1 % accepted risk: the best
  /// ones by score of which at most 1 % are false.
  Share given_at_risk;
  double score_at_risk = 1;  ///< the least score among these
  Share given_at_099;        ///< the same by the score's own word: those with score >= 0.99
  Share false_at_099;        ///< of those
};

Figures figures_of(const Judged& judged, const std::string& name,
                   const std::function<bool(const std::string& level, const std::string& part)>& wanted);

/// All, then each level (where there are several or one is known), then each class.
std::vector<Figures> all_figures(const Judged& judged);

Confidence confidence_of(const Judged& judged);

}  // namespace tribin::eval
