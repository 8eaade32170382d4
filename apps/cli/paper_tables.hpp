#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tribin/core/stage_times.hpp"
#include "tribin/eval/eval.hpp"

namespace tribin::cli {

/// What the paper's own recognition and pose made of the same primitives.
struct PaperMethodRun {
  bool answered = false;
  bool class_right = false;  ///< the best answer is of the right class
  bool found = false;        ///< and in the right place
  eval::PoseError error;     ///< of the best answer, where the class is right, whatever its size
  double ms = 0;             ///< recognition and pose alone
  std::string refused_by;    ///< the test that the furthest candidates fell to, where there is no answer
};

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
  std::optional<PaperMethodRun> paper;  ///< --method both
};

/// What the paper's method made of a run, for one line of progress; empty where it was not asked.
std::string paper_method_words(const PaperRun& run);

/// Tables I and II with the paper's figures beside ours, class counts, medians, 95 % quantiles, ratio to the bound.
std::string paper_tables(const std::vector<PaperRun>& runs);

/// The same as JSON, with every run.
std::string paper_json(const std::vector<PaperRun>& runs, bool times);

}  // namespace tribin::cli
