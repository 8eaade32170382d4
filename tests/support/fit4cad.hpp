#pragma once

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "tribin/segmentation/primitives.hpp"

/// The clouds of Fit4CAD (Romanengo et al. 2021) with their exact primitives, and how a segmentation of one is judged.
namespace tribin::test::fit4cad {

struct TruePrimitive {
  std::string type;        ///< Plane, Cylinder, Cone, Sphere, Torus
  std::string parameters;  ///< as the file has them, for people
  std::vector<std::uint32_t> points;
};

struct Model {
  PointSet points;
  std::vector<TruePrimitive> primitives;  ///< a point on an edge belongs to several
};

struct Match {
  double dice = 0;
  bool type_right = false;
  std::string got = "nothing";
  int got_points = 0;
};

struct Score {
  double dice = 0;  ///< mean over the primitives
  int types_right = 0;
  int predicted = 0;
  double seconds = 0;
  std::vector<Match> matches;
};

inline std::filesystem::path archive() {
  const char* root = std::getenv("TRIBIN_DATA");
#ifdef TRIBIN_SOURCE_DIR
  const std::filesystem::path beside = std::filesystem::path(TRIBIN_SOURCE_DIR) / ".." / "shared" / "data";
#else
  const std::filesystem::path beside = "../shared/data";
#endif
  return (root ? std::filesystem::path(root) : beside) / "primitives/fit4cad_training.tar.xz";
}

/// Unpacks the archive once per process. \return the folder of its files, which is removed at exit.
inline const std::filesystem::path& folder() {
  struct Unpacked {
    std::filesystem::path root;
    Unpacked() {
      std::string name = (std::filesystem::temp_directory_path() / "fit4cad_XXXXXX").string();
      if (mkdtemp(name.data()) == nullptr) return;
      root = name;
      const std::string command = "tar -xJf '" + archive().string() + "' -C '" + name + "'";
      if (std::system(command.c_str()) != 0) std::filesystem::remove_all(root), root.clear();
    }
    ~Unpacked() {
      std::error_code ignored;
      if (!root.empty()) std::filesystem::remove_all(root, ignored);
    }
  };
  static const Unpacked unpacked;
  static const std::filesystem::path files = unpacked.root / "fit4cad_training";
  return files;
}

inline std::vector<int> model_numbers() {
  std::vector<int> out;
  for (int number = 1; number <= 190; ++number)
    if (std::filesystem::exists(folder() / ("PC" + std::to_string(number) + ".txt"))) out.push_back(number);
  return out;
}

/// The numbers between brackets: "Primitive3:=[1 2 3" gives {1, 2, 3}.
inline std::vector<double> numbers_after(const std::string& text, std::size_t begin, std::size_t end) {
  std::vector<double> out;
  std::string inner = text.substr(begin, end - begin);
  for (char& c : inner)
    if (c == ',' || c == '[' || c == ']' || c == ';') c = ' ';
  std::istringstream in(inner);
  for (double value; in >> value;) out.push_back(value);
  return out;
}

inline std::string content(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline std::optional<Model> read_model(int number) {
  const std::string stem = "PC" + std::to_string(number);
  const std::string cloud = content(folder() / (stem + ".txt"));
  const std::string lists = content(folder() / (stem + "_primitives.txt"));
  const std::string surfaces = content(folder() / (stem + "_parametric.txt"));
  if (cloud.empty() || lists.empty() || surfaces.empty()) return std::nullopt;
  Model model;
  model.points.source = stem + ".txt";
  const std::vector<double> xyz = numbers_after(cloud, cloud.find('['), cloud.size());
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3)
    model.points.points.push_back(Vec3(xyz[i], xyz[i + 1], xyz[i + 2]).cast<float>());
  std::vector<std::string> types, parameters;
  for (std::size_t at = surfaces.find(":="); at != std::string::npos; at = surfaces.find(":=", at + 2)) {
    const std::size_t open = surfaces.find('[', at), comma = surfaces.find(',', open),
                      close = surfaces.find(']', comma);
    std::string type = surfaces.substr(open + 1, comma - open - 1);
    type.erase(0, type.find_first_not_of(" '\""));
    types.push_back(type.substr(0, type.find_last_not_of(" '\"") + 1));
    parameters.push_back(surfaces.substr(comma + 1, close - comma));
  }
  for (std::size_t at = lists.find("Primitive"); at != std::string::npos; at = lists.find("Primitive", at + 9)) {
    const std::size_t open = lists.find('[', at), close = lists.find(']', open), k = model.primitives.size();
    TruePrimitive next;
    next.type = k < types.size() ? types[k] : "?";
    next.parameters = k < parameters.size() ? parameters[k] : "";
    for (double index : numbers_after(lists, open, close)) next.points.push_back(static_cast<std::uint32_t>(index) - 1);
    model.primitives.push_back(std::move(next));
  }
  return model;
}

/// A tenth of the points, drawn by the seed, each moved by Gaussian noise of `share` of the diagonal on each axis.
/// True primitives of which no point is left are left out.
inline Model noisy_tenth(const Model& model, double share, unsigned seed) {
  std::mt19937 random(seed);
  Vec3f low = model.points.points[0], high = low;
  for (const Vec3f& p : model.points.points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  std::normal_distribution<float> noise(0, static_cast<float>(share) * (high - low).norm());
  std::vector<std::int64_t> place(model.points.points.size(), -1);
  std::vector<std::uint32_t> order(place.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), random);
  order.resize(order.size() / 10);
  Model out;
  out.points.source = model.points.source;
  for (std::uint32_t i : order) {
    place[i] = static_cast<std::int64_t>(out.points.points.size());
    out.points.points.push_back(model.points.points[i] + Vec3f(noise(random), noise(random), noise(random)));
  }
  for (const TruePrimitive& primitive : model.primitives) {
    TruePrimitive left{primitive.type, primitive.parameters, {}};
    for (std::uint32_t i : primitive.points)
      if (place[i] >= 0) left.points.push_back(static_cast<std::uint32_t>(place[i]));
    if (!left.points.empty()) out.primitives.push_back(std::move(left));
  }
  return out;
}

struct Segmented {
  std::vector<std::uint16_t> label;
  Primitives primitives;
  double seconds = 0;
};

inline Segmented segment_cloud(const PointSet& points) {
  const auto start = std::chrono::steady_clock::now();
  Segmented out;
  const Surfels surfels = surfels_from_points(points);
  out.primitives = segment(surfels);
  out.label = label_points(out.primitives, surfels);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

inline Score judge(const Model& model, const Segmented& segmented) {
  Score score;
  score.predicted = static_cast<int>(segmented.primitives.items.size());
  score.seconds = segmented.seconds;
  std::vector<int> size(segmented.primitives.items.size() + 1, 0);
  for (std::uint16_t label : segmented.label) ++size[label];
  for (const TruePrimitive& truth : model.primitives) {
    std::map<std::uint16_t, int> common;
    for (std::uint32_t i : truth.points)
      if (segmented.label[i] > 0) ++common[segmented.label[i]];
    Match match;
    std::uint16_t best = 0;
    for (const auto& [label, count] : common)
      if (best == 0 || count > common[best]) best = label;
    if (best > 0) {
      match.dice = 2.0 * common[best] / (static_cast<double>(truth.points.size()) + size[best]);
      const Primitive& p = segmented.primitives.items[best - 1u];
      match.got = name_of(p.type);
      match.got_points = size[best];
      std::string wanted = truth.type;
      for (char& c : wanted) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      match.type_right = wanted == match.got;
    }
    score.dice += match.dice / static_cast<double>(model.primitives.size());
    score.types_right += match.type_right;
    score.matches.push_back(std::move(match));
  }
  return score;
}

}  // namespace tribin::test::fit4cad
