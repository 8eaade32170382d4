#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tribin/part/part.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin::eval {

// How results are judged: found, false, and how far off. One implementation for `bench`, the campaigns and the tests.

/// What judging needs of a part: its points and its true symmetries.
struct Model {
  std::string name;
  int id = 0;                   ///< obj_id of the data set; 0 = not from one
  std::vector<Vec3f> vertices;  ///< part frame [mm]
  std::vector<Vec3f> surface;   ///< points spread evenly over it, in an order whose prefixes are even too; may be empty
  double diameter_mm = 0;
  Vec3 box_center = Vec3::Zero();
  std::vector<Pose> near_symmetries;  ///< part_from_part, that leave most of the surface in place
  SymmetryGroup symmetry;             ///< no discrete entry means the identity alone
};

/// A part that is really there.
struct Truth {
  std::string part;
  Pose camera_from_part = Pose::Identity();
  double visible_fraction = 1;  ///< BOP visib_fract
  double bound_mm = 0;          ///< Cramer-Rao bound of the very pixels at the box's centre, norm; 0 = not known
  double bound_rotation = 0;    ///< [rad]
};

/// How far an answer is from a truth, modulo the symmetry that brings them closest.
struct PoseError {
  double mssd_mm = 0;                       ///< largest distance of one vertex in both poses
  double translation_mm = 0;                ///< at the centre of the box
  double rotation = 0;                      ///< [rad]
  Vec3 translation_axes_mm = Vec3::Zero();  ///< answer minus truth at the centre of the box, camera axes
  Vec3 rotation_axes = Vec3::Zero();        ///< w with R_answer = Exp(w) R_truth [rad], camera axes
};

/// \source BOP's MSSD (Hodan et al. 2020); over a continuous symmetry the angle of least rotation is taken in closed
/// form
///         instead of BOP's steps of 0.01 diameters. It can only make the error larger than the true minimum.
PoseError pose_error(const Model& model, const Pose& answer, const Pose& truth);

struct Match {
  int answer = 0;  ///< index
  int truth = 0;   ///< index
  PoseError error;
};

/// One scene judged. An answer that fits a truth which shows less than `min_visible` is in none of the lists.
struct Judgement {
  std::vector<Match> found;        ///< in the order of the answers
  std::vector<int> false_answers;  ///< indices: wrong class, wrong place, duplicates
  std::vector<int> missed;         ///< indices of truths that were asked for
  int asked = 0;                   ///< truths that show at least min_visible
};

/// An instance is found when an answer of its class has MSSD < 5 % of the diameter; each truth once, best score first.
/// \param models  one for each name among answers and truths.
Judgement judge(std::span<const Instance> answers, std::span<const Truth> truths, std::span<const Model> models,
                double min_visible = 0);

Model model_of(const Part& part);

/// Share of the surface in one pose that lies within `limit_mm` of the surface in the other: 1 for poses that a scan
/// cannot tell apart. \param model  with its surface.
double overlap(const Model& model, const Pose& a, const Pose& b, double limit_mm);

/// `count` points on the triangles, in equal shares of area, any prefix too; none on a mesh without area.
/// \param normals  gets the facet normal of each, if given.
/// \source van der Corput's sequences in place of chance.
std::vector<Vec3f> points_on(const Mesh& mesh, int count, std::vector<Vec3f>* normals = nullptr);

/// The models of a BOP data set, with the true symmetries of models_info.json, in the order of the object ids; the name
/// is its `name`, or obj_%06d.
/// \throws Error bad_input
std::vector<Model> read_bop_models(const std::filesystem::path& models_dir);

/// The true instances of one image; names come from the models, by id.
/// \param scene_gt  path of scene_gt.json; scene_gt_info.json beside it gives the visible fractions, if it is there.
/// \throws Error bad_input
std::vector<Truth> read_bop_truth(const std::filesystem::path& scene_gt, int image,
                                  const std::filesystem::path& models_dir);

/// A share with its 95 % interval.
struct Share {
  int count = 0;
  int of = 0;
  double low = 0;
  double high = 1;
};
/// \source Wilson's score interval.
Share share_of(int count, int of);

/// A number with its 95 % interval.
struct Estimate {
  double value = 0;
  double low = 0;
  double high = 0;  ///< infinite where too few values bound it
  int count = 0;
};
/// Quantile q with the interval that order statistics give, without assumption on the distribution.
Estimate quantile_estimate(const std::vector<double>& values, double q);

/// The value below which a share q of the sorted values lies, between neighbours by line; 0 if there are none.
double quantile(std::vector<double> values, double q);

}  // namespace tribin::eval
