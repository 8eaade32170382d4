#pragma once

#include <string>
#include <vector>

#include "tribin/core/stage_times.hpp"
#include "tribin/eval/eval.hpp"

namespace tribin::cli {

/// One pose of the paper's experiment and what was made of it.
struct PaperRun {
  std::string part;
  int seed = 0;
  bool class_right = false;  ///< the best answer is of the right class
  bool found = false;        ///< and in the right place (MSSD < 5 % of the diameter)
  int false_answers = 0;
  eval::PoseError error;  ///< where found
  double bound_translation_mm =
      0;                      ///< Cramer-Rao bound of the very pixels: sd of the box's centre, norm; 0 = not known
  double bound_rotation = 0;  ///< [rad], norm
  StageTimes times;
};

/// Tables I and II with the paper's figures beside ours, class counts, medians, 95 % quantiles, ratio to the bound.
std::string paper_tables(const std::vector<PaperRun>& runs);

/// The same as JSON, with every run.
std::string paper_json(const std::vector<PaperRun>& runs, bool times);

}  // namespace tribin::cli
