#pragma once

#include <span>
#include <string>
#include <vector>

#include "tribin/eval/results.hpp"

namespace tribin::eval {

/// What an answer turned out to be. All but the first two are false.
enum class Verdict : std::uint8_t {
  found,        ///< of a part that shows enough to be asked for
  not_asked,    ///< right, of a part that shows less
  duplicate,    ///< of a part that a better answer has taken
  flip,         ///< right class and place, false only by a self-similar pose or turn
  wrong_class,  ///< where a part of another class lies
  wrong_place,  ///< within half a diameter of a part of its class
  nothing_there
};
const char* name_of(Verdict verdict);
inline bool is_false(Verdict v) { return v != Verdict::found && v != Verdict::not_asked; }

/// One answer and what is true about it.
struct JudgedAnswer {
  int scene = 0, image = 0;
  std::string level, part;
  double score = 0;
  Verdict verdict = Verdict::nothing_there;
  double visible = 0;         ///< of the part that it is, or lies nearest to
  PoseError error;            ///< where right
  double bound_mm = 0;        ///< of the part, 0 = not known
  double bound_rotation = 0;  ///< [rad]
  int rank = 0;               ///< of the covariance; 0 = there is none
  double chi_square = 0;      ///< of the error by the covariance, where right and rank > 0
  int alternatives = 0;       ///< poses that the scan did not settle
  bool told = false;          ///< false, but one of its alternatives is right
  Vec3 at_mm = Vec3::Zero();  ///< the box's centre, camera frame
  std::string confused_with;  ///< wrong_class: the part that is there
};

/// A part that was offered and is there.
struct JudgedTruth {
  int scene = 0, image = 0;
  std::string level, part;
  double visible = 0;
  int place = 0;              ///< in ImageTruth::truths
  int answer = -1;            ///< index of the right answer; -1 = missed
  Vec3 at_mm = Vec3::Zero();  ///< the box's centre, camera frame
  bool in_view = true;        ///< the scan shows what tells it from its self-similar poses; see mark_in_view
  bool withheld = false;      ///< missed, but listed as uncertain at its place
  std::string reason;         ///< missed: what the nearest refused candidate fell to, where the results tell
};

/// A whole set of results, judged.
struct Judged {
  std::vector<JudgedAnswer> answers;
  std::vector<JudgedTruth> truths;
  int images = 0;
  int images_without_result = 0;  ///< their parts count as missed
  int images_without_parts = 0;   ///< empty, or with foreign objects only
  int given_without_parts = 0;    ///< answers in those
  std::vector<double> seconds;    ///< of the images, where known
  bool uncertainty = false;       ///< the results tell covariances
  bool in_view_known = false;     ///< mark_in_view was called
};

/// An image to be judged.
struct ImageTruth {
  int scene = 0, image = 0;
  std::string level;          ///< of the simulation; "" = not known
  std::vector<Truth> truths;  ///< all that is there, offered or not
};

/// The truth of the images of a split. \param targets  as for list_bop_tasks: those images only; empty = all.
/// \throws Error bad_input
std::vector<ImageTruth> read_truths(const std::filesystem::path& dataset, const std::string& split,
                                    const std::filesystem::path& targets, const std::filesystem::path& models_dir);

/// Judges results by docs/eval.md: found by MSSD < 5 % of the diameter, each truth once, best score first.
/// \param min_visible  parts that show less are not asked for.
Judged judge_results(std::span<const ImageTruth> images, std::span<const ImageResult> results,
                     std::span<const Model> models, double min_visible = 0.4);

/// Finds out for each truth whether the scan tells it from its self-similar poses (`near_symmetries_discrete`), as
/// in_view.hpp has it: reads the scans and the models again. \param images, models  those that were judged.
void mark_in_view(Judged& judged, std::span<const ImageTruth> images, std::span<const Model> models,
                  const std::filesystem::path& dataset, const std::string& split,
                  const std::filesystem::path& models_dir);

/// Mahalanobis distance squared of an answer from the truth, free directions left out; the rank is 6 - their number.
/// \param truth  already turned by the symmetry that brings it closest.
double chi_square(const Instance& answer, const Pose& truth);

}  // namespace tribin::eval
