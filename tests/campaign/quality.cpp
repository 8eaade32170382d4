// Good and damaged parts in simulated heaps: are good ones called good, and damaged ones told? A third of the parts of
// each heap is damaged: a dent of 1 to 2 mm over 5 % of the surface, an end broken off, or a round surface of another
// radius. Damage is in view when the scan shows it on 3 % of the part's silhouette at least, by 0.5 mm or more.
// usage: campaign_quality [LEVEL = easy] [SCENES = 10] [SEED = 500]

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <string>

#include "campaign/heaps_parts.hpp"
#include "sim/drawn_scene.hpp"
#include "support/damage.hpp"
#include "tribin/eval/eval.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/part_cache.hpp"
#include "tribin/pose/index_render.hpp"

namespace {

using namespace tribin;
using namespace tribin::sim;

struct Damaged {
  std::string kind;  ///< empty = good
  Mesh mesh;
};

/// A part's own mesh with one fault, drawn by the seed. \param up  of the world, part frame: dents lie where one sees.
Damaged damaged(const Part& part, const Vec3& up, Random& random) {
  const int which = random.integer(0, 2);
  if (which == 1) {
    // The outermost twelfth along an axis of the box: what sticks out of it most.
    // Not of the thinnest: from above nobody sees how thick a plate is.
    Eigen::Index thinnest = 0;
    Eigen::Vector3d(part.box_max - part.box_min).minCoeff(&thinnest);
    const int axis = (static_cast<int>(thinnest) + random.integer(1, 2)) % 3;
    const double sign = random.integer(0, 1) ? 1 : -1;
    Vec3 n = Vec3::Zero();
    n[axis] = sign;
    const double end = sign > 0 ? part.box_max[axis] : -part.box_min[axis];
    return {"broken", test::broken_off(part.mesh, n, end - (part.box_max[axis] - part.box_min[axis]) / 12)};
  }
  if (which == 2) {
    std::vector<const Primitive*> round;
    for (const Primitive& p : part.model.primitives)
      if (p.type == PrimitiveType::cylinder && !p.fillet && p.arc > kPi && p.area_mm2 > 0.04 * part.area_mm2)
        round.push_back(&p);
    if (!round.empty()) {
      const Primitive& p = *round[static_cast<std::size_t>(random.integer(0, static_cast<int>(round.size()) - 1))];
      const double by = (random.integer(0, 1) ? 1 : -1) * std::max(0.6, 0.03 * p.radius_mm);
      return {"radius", test::with_other_radius(part.mesh, p.axis, p.point, p.radius_mm, by)};
    }
  }
  std::vector<Vec3f> normals;
  const std::vector<Vec3f> points = eval::points_on(part.mesh, 2000, &normals);
  const double radius = std::sqrt(0.05 * part.area_mm2 / kPi);
  for (int attempt = 0; attempt < 200; ++attempt) {
    const auto k = static_cast<std::size_t>(random.integer(0, static_cast<int>(points.size()) - 1));
    if (normals[k].cast<double>().dot(up) < 0.8) continue;
    return {"dent", test::with_dent(part.mesh, points[k].cast<double>(), normals[k].cast<double>(), radius,
                                    random.uniform(1, 2))};
  }
  return {"", part.mesh};
}

/// Share of the nominal silhouette where what is really there lies 0.5 mm and more off the CAD, measured and not
/// hidden.
double share_in_view(const Part& part, const Pose& pose, const SimulatedScan& seen, int body) {
  IndexRender r;
  render_index(part.render_mesh, seen.scan.camera, pose, 1, r);
  int off = 0;
  for (int j = 0; j < r.height; ++j)
    for (int i = 0; i < r.width; ++i) {
      const int u = r.u0 + i, v = r.v0 + j;
      const std::size_t k = r.index(i, j);
      if (r.triangle[k] < 0 || !seen.true_z.contains(u, v) || !(seen.scan.z_mm(u, v) > 0)) continue;
      const double z = 1 / r.inverse_z[k], truth = seen.true_z(u, v);
      const double along =
          std::abs(r.normal[static_cast<std::size_t>(r.triangle[k])].cast<double>().dot(seen.scan.camera.ray(u, v)));
      const bool hidden = seen.body(u, v) != body && truth < z;
      off += !hidden && std::abs(truth - z) * along > 0.5;
    }
  return r.silhouette_pixels ? double(off) / double(r.silhouette_pixels) : 0;
}

struct Tally {
  int nominal = 0, deviates = 0, not_checked = 0, not_given = 0;
  int all() const { return nominal + deviates + not_checked + not_given; }
  void add(const Instance* instance) {
    if (!instance)
      ++not_given;
    else if (instance->quality.decision == QualityDecision::nominal)
      ++nominal;
    else if (instance->quality.decision == QualityDecision::deviates)
      ++deviates;
    else
      ++not_checked;
  }
};

void print(const std::string& name, const Tally& t) {
  const int given = t.all() - t.not_given;
  const eval::Share s = eval::share_of(t.deviates, given);
  std::printf("%-16s %4d: given out %d, of these deviate %d (%.1f %%, %.1f-%.1f), nominal %d, not checked %d\n",
              name.c_str(), t.all(), given, t.deviates, given ? 100.0 * t.deviates / given : 0.0, 100 * s.low,
              100 * s.high, t.nominal, t.not_checked);
}

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int i, const char* otherwise) { return std::string(argc > i ? argv[i] : otherwise); };
  const LevelSettings& level = settings_of(level_of(argument(1, "easy")));
  const int scenes = std::atoi(argument(2, "10").c_str());
  const auto first = static_cast<std::uint64_t>(std::atoll(argument(3, "500").c_str()));
  std::vector<Part> parts;
  std::vector<Mesh> meshes;
  for (const std::string& name : campaign::heap_parts("build/campaign/quality/parts")) {
    if (name.ends_with(".step")) continue;  // read by an optional library
    const std::size_t equals = name.find('=');
    PartReadOptions options;
    if (equals != std::string::npos) options.name = name.substr(0, equals);
    options.cache = part_cache_folder();
    parts.push_back(read_part(equals == std::string::npos ? name : name.substr(equals + 1), options));
    meshes.push_back(parts.back().mesh);
  }
  const SceneStock stock = make_stock(meshes, SceneKind::bin, level);
  std::map<std::string, Tally> tallies;
  for (int s = 0; s < scenes; ++s) {
    const std::uint64_t seed = mixed(first + static_cast<std::uint64_t>(s));
    DrawnScene scene = draw_bin_scene(stock, SceneKind::bin, level, seed);
    Random random(seed ^ 0xDA3A6EDu);
    const Pose world_from_camera = scene.camera_from_world.inverse();
    std::deque<Mesh> own;  // bodies point to them
    std::vector<std::string> fault(scene.bodies.size());
    std::vector<int> offered;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
      const int object = scene.object_of_body[b];
      if (object == 0) continue;
      offered.push_back(object - 1);
      if (random.uniform() > 1.0 / 3) continue;
      const Pose world_from_part = world_from_camera * scene.bodies[b].camera_from_body;
      const Vec3 up = world_from_part.linear().transpose() * Vec3::UnitZ();
      Damaged d = damaged(parts[static_cast<std::size_t>(object - 1)], up, random);
      fault[b] = d.kind;
      own.push_back(std::move(d.mesh));
      scene.bodies[b].mesh = &own.back();
    }
    std::sort(offered.begin(), offered.end());
    offered.erase(std::unique(offered.begin(), offered.end()), offered.end());
    std::vector<Part> wanted;
    for (const int k : offered) wanted.push_back(parts[static_cast<std::size_t>(k)]);
    const SimulatedScan seen = simulate_scan(scene.bodies, scene.sensor, seed);
    const Found found = find_parts(seen.scan, wanted);
    std::vector<bool> taken(found.instances.items.size(), false);
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
      if (scene.object_of_body[b] == 0 || seen.bodies[b].visible_fraction() < 0.4) continue;
      const Part& part = parts[static_cast<std::size_t>(scene.object_of_body[b] - 1)];
      const Pose& pose = scene.bodies[b].camera_from_body;
      const Instance* match = nullptr;
      for (std::size_t k = 0; k < taken.size(); ++k) {
        const Instance& i = found.instances.items[k];
        const double away = (i.camera_from_part * part.box_center() - pose * part.box_center()).norm();
        if (!taken[k] && i.part == part.name && away < 0.05 * part.diameter_mm) match = &i, taken[k] = true;
        if (match) break;
      }
      const double shown = fault[b].empty() ? 0 : share_in_view(part, pose, seen, static_cast<int>(b));
      const std::string name = fault[b].empty() ? "good" : shown >= 0.03 ? fault[b] : "hidden " + fault[b];
      tallies[name].add(match);
      if (!match) continue;
      const bool told = match->quality.decision == QualityDecision::deviates;
      if (told != !fault[b].empty() && name.find("hidden") == std::string::npos)
        std::printf("scene %d: %s %s (%.0f %% of it shows that): %s %s\n", s, name.c_str(), part.name.c_str(),
                    100 * shown, name_of(match->quality.decision),
                    match->quality.reasons.empty() ? "" : match->quality.reasons[0].c_str());
    }
  }
  std::printf("\n%s, %d scenes from seed %llu; parts that show 40 %% of themselves:\n", level.name, scenes,
              static_cast<unsigned long long>(first));
  for (const auto& [name, tally] : tallies) print(name, tally);
  return 0;
}
