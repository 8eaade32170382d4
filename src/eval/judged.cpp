#include "tribin/eval/judged.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <map>

#include "eval/bop_files.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/eval/bop_dataset.hpp"
#include "tribin/eval/in_view.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/scan_files.hpp"

namespace tribin::eval {
namespace {

namespace fs = std::filesystem;

// An answer is a flip where a scan could hardly tell: most of the surface lies in the same place to 2 % of the
// diameter.
constexpr double kFlipOverlap = 0.7, kFlipLimit = 0.02;
// Of the answer's diameter: nearer than this two parts cannot both lie, whatever their shapes, but in each other's
// holes.
constexpr double kSamePlace = 0.3;

const Model& model_of_part(std::span<const Model> models, const std::string& name) {
  for (const Model& model : models)
    if (model.name == name) return model;
  throw Error(ErrorCode::bad_input, "no model is named '" + name + "' among those to judge by");
}

Vec3 center_of(const Model& model, const Pose& pose) { return pose * model.box_center; }

/// The truth turned by the symmetry that brings it closest to the answer.
Pose nearest_truth(const PoseError& error, const Model& model, const Pose& answer) {
  Pose out = answer;
  out.linear() = rotation_from_vector(Vec3(-error.rotation_axes)) * answer.linear();
  out.translation() = answer * model.box_center - error.translation_axes_mm - out.linear() * model.box_center;
  return out;
}

struct Image {
  const ImageTruth* truth = nullptr;
  const ImageResult* result = nullptr;
};

/// Why a false answer is false. \param taken  truths that a right answer has.
void explain(const Instance& answer, const std::vector<Truth>& truths, const std::vector<char>& taken,
             std::span<const Model> models, JudgedAnswer& out) {
  const Model& model = model_of_part(models, answer.part);
  double nearest = 1e300;
  for (std::size_t t = 0; t < truths.size(); ++t) {
    const Model& other = model_of_part(models, truths[t].part);
    const double distance =
        (center_of(other, truths[t].camera_from_part) - center_of(model, answer.camera_from_part)).norm();
    if (distance < nearest) {
      nearest = distance;
      out.visible = truths[t].visible_fraction;
      if (truths[t].part != answer.part && distance < kSamePlace * model.diameter_mm) {
        out.verdict = Verdict::wrong_class;
        out.confused_with = truths[t].part;
      }
    }
  }
  for (std::size_t t = 0; t < truths.size(); ++t) {
    if (truths[t].part != answer.part) continue;
    const Pose& there = truths[t].camera_from_part;
    const double distance = (center_of(model, there) - center_of(model, answer.camera_from_part)).norm();
    if (distance > 0.5 * model.diameter_mm) continue;
    const bool same = pose_error(model, answer.camera_from_part, there).mssd_mm < 0.05 * model.diameter_mm;
    const bool alike =
        same || overlap(model, answer.camera_from_part, there, kFlipLimit * model.diameter_mm) >= kFlipOverlap;
    for (const Alternative& other : answer.alternatives)
      if (!taken[t] && pose_error(model, other.camera_from_part, there).mssd_mm < 0.05 * model.diameter_mm)
        out.told = true;
    if (alike) {
      out.verdict = taken[t] ? Verdict::duplicate : Verdict::flip;
      out.visible = truths[t].visible_fraction;
      if (!taken[t]) return;
    } else if (out.verdict == Verdict::nothing_there) {
      out.verdict = Verdict::wrong_place;
      out.visible = truths[t].visible_fraction;
    }
  }
}

/// What the refused candidate nearest to a missed part fell to.
std::string reason_near(const std::vector<Reason>& rejected, const std::string& part, const Vec3& at, double limit) {
  std::string out;
  for (const Reason& reason : rejected) {
    if (reason.part != part || !reason.at_mm) continue;
    const double distance = (*reason.at_mm - at).norm();
    if (distance >= limit) continue;
    limit = distance;
    char text[160];
    std::snprintf(text, sizeof text, "%s, %s: %.3g, limit %.3g", reason.stage.c_str(), reason.test.c_str(),
                  reason.value, reason.limit);
    out = text;
  }
  return out;
}

Judged judge_image(const Image& image, std::span<const Model> models, double min_visible) {
  static const ImageResult kNothing;
  const ImageResult& result = image.result ? *image.result : kNothing;
  const std::vector<Truth>& all = image.truth->truths;
  Judged out;
  out.images = 1;
  out.images_without_result = image.result == nullptr;
  out.images_without_parts = all.empty();
  out.given_without_parts = all.empty() ? static_cast<int>(result.instances.size()) : 0;
  if (result.seconds >= 0) out.seconds.push_back(result.seconds);

  std::vector<Truth> offered;  // what was not looked for is not asked for
  std::vector<int> place;      // of these among all
  for (std::size_t t = 0; t < all.size(); ++t)
    if (!result.offered || std::count(result.offered->begin(), result.offered->end(), all[t].part)) {
      offered.push_back(all[t]);
      place.push_back(static_cast<int>(t));
    }
  const Judgement judged = judge(result.instances, offered, models);
  std::vector<char> taken(all.size(), 0), right(result.instances.size(), 0);
  std::vector<int> answer_of(offered.size(), -1);
  for (const Match& match : judged.found) {
    right[match.answer] = 1;
    answer_of[match.truth] = match.answer;
    taken[place[match.truth]] = 1;
  }
  for (std::size_t a = 0; a < result.instances.size(); ++a) {
    const Instance& instance = result.instances[a];
    const Model& model = model_of_part(models, instance.part);
    JudgedAnswer answer;
    answer.scene = image.truth->scene, answer.image = image.truth->image, answer.level = image.truth->level;
    answer.part = instance.part;
    answer.score = instance.score;
    answer.alternatives = static_cast<int>(instance.alternatives.size());
    answer.at_mm = center_of(model, instance.camera_from_part);
    if (!instance.covariance.isZero()) out.uncertainty = true;
    if (right[a]) {
      const auto match = std::find_if(judged.found.begin(), judged.found.end(),
                                      [&](const Match& m) { return m.answer == static_cast<int>(a); });
      const Truth& truth = offered[match->truth];
      answer.error = match->error;
      answer.visible = truth.visible_fraction;
      answer.bound_mm = truth.bound_mm;
      answer.bound_rotation = truth.bound_rotation;
      answer.verdict = truth.visible_fraction >= min_visible ? Verdict::found : Verdict::not_asked;
      if (!instance.covariance.isZero()) {
        answer.rank = 6 - static_cast<int>(instance.free_directions.size());
        answer.chi_square = chi_square(instance, nearest_truth(match->error, model, instance.camera_from_part));
      }
    } else {
      explain(instance, all, taken, models, answer);
    }
    out.answers.push_back(std::move(answer));
  }
  for (std::size_t t = 0; t < offered.size(); ++t) {
    const Model& model = model_of_part(models, offered[t].part);
    JudgedTruth truth;
    truth.scene = image.truth->scene, truth.image = image.truth->image, truth.level = image.truth->level;
    truth.part = offered[t].part;
    truth.visible = offered[t].visible_fraction;
    truth.place = place[t];
    truth.answer = answer_of[t];
    truth.at_mm = center_of(model, offered[t].camera_from_part);
    if (truth.answer < 0)
      truth.reason = reason_near(result.rejected, truth.part, truth.at_mm, kSamePlace * model.diameter_mm);
    truth.withheld =
        truth.answer < 0 && std::any_of(result.uncertain.begin(), result.uncertain.end(), [&](const Instance& unsure) {
          return unsure.part == truth.part &&
                 (center_of(model, unsure.camera_from_part) - truth.at_mm).norm() < kSamePlace * model.diameter_mm;
        });
    out.truths.push_back(std::move(truth));
  }
  return out;
}

void append(Judged& all, Judged&& one) {
  const int before = static_cast<int>(all.answers.size());
  for (JudgedTruth& truth : one.truths) {
    if (truth.answer >= 0) truth.answer += before;
    all.truths.push_back(std::move(truth));
  }
  for (JudgedAnswer& answer : one.answers) all.answers.push_back(std::move(answer));
  all.images += one.images;
  all.images_without_result += one.images_without_result;
  all.images_without_parts += one.images_without_parts;
  all.given_without_parts += one.given_without_parts;
  all.seconds.insert(all.seconds.end(), one.seconds.begin(), one.seconds.end());
  all.uncertainty = all.uncertainty || one.uncertainty;
}

}  // namespace

const char* name_of(Verdict verdict) {
  static constexpr const char* kNames[] = {"found",       "not_asked",   "duplicate",    "flip",
                                           "wrong_class", "wrong_place", "nothing_there"};
  return kNames[static_cast<int>(verdict)];
}

void mark_in_view(Judged& judged, std::span<const ImageTruth> images, std::span<const Model> models,
                  const fs::path& dataset, const std::string& split, const fs::path& models_dir) {
  std::map<std::string, RenderMesh> meshes;
  std::map<std::pair<int, int>, const ImageTruth*> image_of;
  for (const BopObject& object : list_bop_objects(models_dir))
    meshes.emplace(object.name, make_render_mesh(read_cad(object.file)));
  for (const ImageTruth& image : images) image_of[{image.scene, image.image}] = &image;
  std::map<std::pair<int, int>, std::vector<JudgedTruth*>> truths_of;
  for (JudgedTruth& truth : judged.truths) truths_of[{truth.scene, truth.image}].push_back(&truth);
  for (const BopTask& task : list_bop_tasks(dataset, split, {}, list_bop_objects(models_dir))) {
    const auto truths = truths_of.find({task.scene, task.image});
    if (truths == truths_of.end()) continue;
    const Scan scan = read_scan(task.depth, {.camera_file = task.camera, .image_id = task.image});
    const std::vector<Truth>& all = image_of.at({task.scene, task.image})->truths;
    parallel_each(static_cast<int>(truths->second.size()), [&](int i) {
      JudgedTruth& truth = *truths->second[static_cast<std::size_t>(i)];
      truth.in_view = feature_in_view(scan, meshes.at(truth.part), model_of_part(models, truth.part).near_symmetries,
                                      all[truth.place].camera_from_part);
    });
  }
  judged.in_view_known = true;
}

double chi_square(const Instance& answer, const Pose& truth) {
  // Functionals that do not see the free directions: the complement of these, in any metric.
  Eigen::Matrix<double, 6, Eigen::Dynamic> free(6, answer.free_directions.size());
  for (std::size_t i = 0; i < answer.free_directions.size(); ++i)
    free.col(static_cast<int>(i)) = answer.free_directions[i];
  Eigen::Matrix<double, 6, Eigen::Dynamic> seen = Eigen::Matrix<double, 6, 6>::Identity();
  if (free.cols() > 0) {
    const Eigen::HouseholderQR<Eigen::Matrix<double, 6, Eigen::Dynamic>> qr(free);
    const Eigen::Matrix<double, 6, 6> q = qr.householderQ();
    seen = q.rightCols(6 - free.cols());
  }
  Eigen::Matrix<double, 6, 1> error;
  error << truth.translation() - answer.camera_from_part.translation(),
      vector_from_rotation(Matrix3(truth.linear() * answer.camera_from_part.linear().transpose()));
  const Eigen::VectorXd e = seen.transpose() * error;
  const Eigen::MatrixXd covariance = seen.transpose() * Eigen::Matrix<double, 6, 6>(answer.covariance) * seen;
  return e.dot(covariance.ldlt().solve(e));
}

std::vector<ImageTruth> read_truths(const fs::path& dataset, const std::string& split, const fs::path& targets,
                                    const fs::path& models_dir) {
  const fs::path info_file = dataset / "scene_info.json";
  const nlohmann::json info = fs::exists(info_file) ? read_bop_json(info_file) : nlohmann::json::object();
  std::vector<ImageTruth> out;
  for (const BopTask& task : list_bop_tasks(dataset, split, targets, list_bop_objects(models_dir))) {
    const std::string key = std::to_string(task.scene);
    const std::string level = info.contains(key) ? info.at(key).value("level", "") : "";
    out.push_back({task.scene, task.image, level,
                   read_bop_truth(task.camera.parent_path() / "scene_gt.json", task.image, models_dir)});
  }
  return out;
}

Judged judge_results(std::span<const ImageTruth> images, std::span<const ImageResult> results,
                     std::span<const Model> models, double min_visible) {
  std::map<std::pair<int, int>, const ImageResult*> of_image;
  for (const ImageResult& result : results) of_image[{result.scene, result.image}] = &result;
  std::vector<Judged> judged(images.size());
  parallel_each(static_cast<int>(images.size()), [&](int i) {
    const auto result = of_image.find({images[i].scene, images[i].image});
    judged[i] = judge_image({&images[i], result == of_image.end() ? nullptr : result->second}, models, min_visible);
  });
  Judged out;
  for (Judged& one : judged) append(out, std::move(one));
  return out;
}

}  // namespace tribin::eval
