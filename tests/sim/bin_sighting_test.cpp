#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "sim/drawn_scene.hpp"
#include "sim/foreign_objects.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/recognition/bin.hpp"
#include "tribin/sim/stable_rests.hpp"

namespace tribin::sim {
namespace {

/// A simulated bin as the sensor sees it, with what is true of it.
struct SeenBin {
  DrawnScene drawn;
  Scan scan;
  BinShape shape;
};

SeenBin seen_bin(const SceneStock& stock, SceneKind kind, Level level, std::uint64_t seed) {
  SeenBin out;
  out.drawn = draw_bin_scene(stock, kind, settings_of(level), seed);
  out.scan = simulate_scan(out.drawn.bodies, out.drawn.sensor, seed).scan;
  const auto inner = out.drawn.info.at("bin_inner_mm").get<std::vector<double>>();
  out.shape = {{inner[0], inner[1], inner[2]}, out.drawn.info.at("wall_mm").get<double>()};
  return out;
}

/// Share of the inner volume below the highest surface of what lies in the bin, seen from straight above.
double true_fill(const SeenBin& seen) {
  constexpr double kPitch = 2;
  const Vec3 size = seen.shape.inner_size_mm;
  Image<double> height(static_cast<int>(size.x() / kPitch), static_cast<int>(size.y() / kPitch), 0);
  const Pose bin_from_camera = seen.drawn.camera_from_world.inverse();
  for (std::size_t b = 2; b < seen.drawn.bodies.size(); ++b) {  // after the table and the bin
    const Body& body = seen.drawn.bodies[b];
    for (const auto& t : body.mesh->triangles) {
      std::array<Vec3, 3> p;
      for (int k = 0; k < 3; ++k)
        p[k] = bin_from_camera * (body.camera_from_body * Vec3(body.mesh->vertices[t[k]].cast<double>()));
      const double longest = std::max({(p[1] - p[0]).norm(), (p[2] - p[0]).norm(), (p[2] - p[1]).norm()});
      const int n = static_cast<int>(2 * longest / kPitch) + 1;
      for (int i = 0; i <= n; ++i)
        for (int j = 0; i + j <= n; ++j) {
          const Vec3 q = p[0] + (p[1] - p[0]) * i / n + (p[2] - p[0]) * j / n;
          const int x = static_cast<int>(std::floor((q.x() + size.x() / 2) / kPitch)),
                    y = static_cast<int>(std::floor((q.y() + size.y() / 2) / kPitch));
          if (height.contains(x, y)) height(x, y) = std::max(height(x, y), std::min(q.z(), size.z()));
        }
    }
  }
  double sum = 0;
  for (const double h : height.data) sum += h;
  return sum / (static_cast<double>(height.size()) * size.z());
}

class SimulatedBin : public testing::Test {
 protected:
  SimulatedBin() : parts_(foreign_objects(90)) {}
  SceneStock stock(SceneKind kind, Level level) const { return make_stock(parts_, kind, settings_of(level)); }
  Found look(const SeenBin& seen, const std::optional<Pose>& given) const {
    static const std::vector<Part> parts = {compile_part(parts_[4])};  // an angle: the other four are not offered
    FinderOptions options;
    options.bin = KnownBin{seen.shape, given, 0, 0};
    return find_parts(seen.scan, parts, options);
  }
  std::vector<Mesh> parts_;
};

TEST_F(SimulatedBin, IsFoundUnderAHeapAndTellsHowFullItIs) {
  const SceneStock dense = stock(SceneKind::bin, Level::dense);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const SeenBin seen = seen_bin(dense, SceneKind::bin, Level::dense, seed);
    const Pose& truth = seen.drawn.camera_from_world;
    const double fill = true_fill(seen);
    for (const std::optional<Pose>& given : {std::optional<Pose>(truth), std::optional<Pose>()}) {
      const Surfels surfels = surfels_from_scan(seen.scan);
      const BinSighting bin = find_bin({seen.shape, given, 0, 0}, surfels, build_model(segment(surfels), surfels));
      ASSERT_TRUE(bin.found) << bin.reason;
      const Vec3 rim(0, 0, seen.shape.inner_size_mm.z());
      // The level's smooth errors are 0.05 % of the depth at most, on rims a pixel or two are lost to shadow.
      const double distance = (truth * rim).z();
      EXPECT_LT((bin.camera_from_bin * rim - truth * rim).norm(), 0.001 * distance);
      EXPECT_NEAR(bin.fill, fill, 0.1);
      if (given) {
        EXPECT_LT(*bin.drift_sigma, kDriftLimit);
      }
    }
  }
}

TEST_F(SimulatedBin, IsEmptyOrHoldsWhatNoPartExplains) {
  for (const SceneKind kind : {SceneKind::empty, SceneKind::foreign}) {
    const SceneStock things = stock(kind, Level::easy);
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      SCOPED_TRACE(testing::Message() << (kind == SceneKind::empty ? "empty " : "foreign ") << seed);
      const SeenBin seen = seen_bin(things, kind, Level::easy, seed);
      const Found found = look(seen, seen.drawn.camera_from_world);
      ASSERT_TRUE(found.bin->found) << found.bin->reason;
      EXPECT_NEAR(found.bin->fill, true_fill(seen), 0.1);
      if (kind == SceneKind::empty) {
        EXPECT_EQ(found.status, "empty");
        EXPECT_LT(found.bin->fill, 0.005);
        EXPECT_TRUE(found.instances.unexplained.empty());
        EXPECT_TRUE(found.warnings.empty());
      } else {
        EXPECT_FALSE(found.instances.items.empty() && found.instances.unexplained.empty());
        EXPECT_NE(found.status, "empty");
      }
    }
  }
}

TEST_F(SimulatedBin, ThreeMillimetresRaiseTheAlarm) {
  const SceneStock none = stock(SceneKind::empty, Level::easy);
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE(seed);
    const SeenBin seen = seen_bin(none, SceneKind::empty, Level::easy, seed);
    Pose shifted = seen.drawn.camera_from_world;
    shifted.translation() += Vec3(seed == 1 ? 3 : 0, 0, seed == 1 ? 0 : 3);
    const Found found = look(seen, shifted);
    ASSERT_TRUE(found.bin->found) << found.bin->reason;
    EXPECT_NEAR(found.bin->drift_mm, 3, 0.5);
    ASSERT_EQ(found.warnings.size(), 1u);
    EXPECT_EQ(found.warnings[0].code, "calibration_drift");
  }
}

/// Of a battery that lies on its lid or on a side, the scan shows faces that look alike turned round: the floor that it
/// lies on, and edges seen aslant, tell which way it lies.
TEST(ALoneBattery, IsFoundHoweverItLies) {
  const std::vector<Mesh> meshes = {read_cad(std::filesystem::path(TRIBIN_SOURCE_DIR) / "examples/parts/battery.stl")};
  const std::vector<Part> parts = {compile_part(meshes.front())};
  const SceneStock stock = make_stock(meshes, SceneKind::empty, settings_of(Level::easy));
  int upside_down = 0;
  for (const StableRest& rest : stable_rests(meshes.front())) {
    const Vec3 up = rest.table_from_part.linear().row(2);
    if (up.z() > -0.8 && std::abs(up.y()) < 0.9) continue;  // on its lid, and on its long sides
    for (const double turn : {2.4, 4.5}) {
      SCOPED_TRACE(testing::Message() << "up " << up.transpose() << ", turned " << turn);
      SeenBin seen = seen_bin(stock, SceneKind::empty, Level::easy, 7);
      Pose turned = Pose::Identity();
      turned.linear() = rotation_from_vector(Vec3(0, 0, turn));
      turned.translation() = 0.25 * seen.shape.inner_size_mm.cwiseProduct(Vec3(std::cos(turn), std::sin(turn), 0));
      const Pose camera_from_part = seen.drawn.camera_from_world * turned * rest.table_from_part;
      seen.drawn.bodies.push_back({&meshes.front(), camera_from_part, 0.45, 1});
      seen.scan = simulate_scan(seen.drawn.bodies, seen.drawn.sensor, 7).scan;
      FinderOptions options;
      options.bin = KnownBin{seen.shape, seen.drawn.camera_from_world, 0, 0};
      const Found found = find_parts(seen.scan, parts, options);
      upside_down += up.z() < -0.8;
      ASSERT_EQ(found.instances.items.size(), 1u) << found.instances.uncertain.size() << " uncertain";
      const Instance& instance = found.instances.items.front();
      EXPECT_LT(rotation_angle(instance.camera_from_part.linear(), camera_from_part.linear()), 2 * kDegree);
      const Vec3 middle = parts.front().box_center();
      EXPECT_LT((instance.camera_from_part * middle - camera_from_part * middle).norm(), 1);
      const Matrix3 place = instance.covariance.topLeftCorner<3, 3>();
      EXPECT_LT(place.trace(), 1);
    }
  }
  EXPECT_GE(upside_down, 2);
}

}  // namespace
}  // namespace tribin::sim
