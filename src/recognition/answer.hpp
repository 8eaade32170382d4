#pragma once

#include "choice.hpp"
#include "tribin/pose/systematic_error.hpp"
#include "tribin/recognition/recognize.hpp"

// From a polished pose to an answer: the last refinement, the covariance, the self-similar poses that are left, the
// score.
namespace tribin {

// Given out is what is right two times in three, in full pose, because a grip at a wrong pose costs more than a part
// that waits for the next scan; a place that is sure but not which of its self-similar poses is told apart from them.
// Of 1478 answers in 160 unseen heaps 8 right and 7 wrong ones lie between that and an even chance.
inline constexpr double kGivenOut = 2.0 / 3;

/// An answer, and what speaks for it.
struct Answer {
  Instance instance;
  double place = 0;  ///< probability that class and place are right, whichever pose it is in there
  double held = 0;   ///< probability that the noise leaves the pose within what counts as found
};

/// The last word on a pose, and what its residuals tell of errors that pixels have in common.
struct LastWord {
  Refinement refined;
  CommonErrors errors;
  FieldVariance field;
};

LastWord last_word(const Polished& polished, const Part& part, const SceneDepth& scene, const NoiseProfile& noise);

/// What patches are off by is the scene's and the sensor's as much as the part's: the mean over all that was found.
double common_variance(std::span<const LastWord> all);

/// \param shared_mm2  common_variance of the scan.
Answer make_answer(const Polished& polished, const LastWord& last, double shared_mm2, const Part& part,
                   const RecognitionOptions& recognition);

/// Its score, once its alternatives have changed.
void score_again(Answer& answer);

}  // namespace tribin
