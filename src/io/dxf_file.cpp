#include <algorithm>
#include <cmath>

#include "io/dxf.hpp"
#include "io/mesh_formats.hpp"

namespace tribin::io {
namespace {

constexpr std::size_t kMostTriangles = 5'000'000;  // nested blocks multiply: refused before they are laid out

struct DxfContent {
  double unit_mm = 0;  ///< of the header; 0 = none
  std::map<std::string, DxfBlock> blocks;
  DxfBlock model;
  bool has_model = false;
};

/// Names of blocks do not tell small letters from capitals.
std::string key_of(std::string_view name) {
  std::string key(name);
  for (char& c : key) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return key;
}

double unit_of(std::int64_t insunits) {
  switch (insunits) {
    case 1:
      return 25.4;
    case 2:
      return 304.8;
    case 4:
      return 1;
    case 5:
      return 10;
    case 6:
      return 1000;
    case 8:
      return 25.4e-6;
    case 9:
      return 25.4e-3;
    case 10:
      return 914.4;
    case 13:
      return 1e-3;
    case 14:
      return 100;
    default:
      return 0;  // unitless, or nothing that a part is made in
  }
}

void read_header(DxfGroups& groups, DxfContent& content) {
  for (DxfGroup g = groups.next(); !(g.code == 0 && g.value == "ENDSEC"); g = groups.next()) {
    if (g.code == 0) groups.fail(g, in_quotes(g.value), "ENDSEC");
    if (g.code != 9 || g.value != "$INSUNITS") continue;
    const DxfGroup value = groups.next();
    content.unit_mm = unit_of(groups.whole(value));
  }
}

void read_blocks(DxfGroups& groups, DxfContent& content) {
  DxfGroup g = groups.next();
  while (!(g.code == 0 && g.value == "ENDSEC")) {
    if (g.code != 0 || g.value != "BLOCK") {
      if (g.code == 0 && g.value == "EOF") groups.fail(g, "\"EOF\"", "ENDSEC");
      g = groups.next();
      continue;
    }
    // The block's own groups: name and base point. Entities start with the next 0, which read_dxf_entities looks for.
    std::string name;
    Vec3 base = Vec3::Zero();
    DxfGroups ahead = groups;
    for (DxfGroup own = ahead.next(); own.code != 0; own = ahead.next()) {
      if (own.code == 2) name = key_of(own.value);
      if (own.code == 10 || own.code == 20 || own.code == 30) base[own.code / 10 - 1] = ahead.number(own);
    }
    DxfBlock block = read_dxf_entities(groups, "ENDBLK");
    block.base = base;
    content.blocks.insert_or_assign(name, std::move(block));
    g = groups.next();
    while (g.code != 0) g = groups.next();  // the groups of ENDBLK
  }
}

/// Lays out blocks within blocks.
class Layout {
 public:
  Layout(const FileBytes& file, const DxfContent& content) : file_(file), content_(content) {}

  /// How many triangles a block has with all that is in it; names a block that holds itself.
  std::size_t count(const DxfBlock& block, const std::string& name) {
    if (const auto known = counts_.find(name); known != counts_.end()) {
      if (known->second == kOpen) bad_file(file_.name, "block " + in_quotes(name), "a block that holds itself", "none");
      return known->second;
    }
    constexpr std::size_t kDeepest = 200;  // of the call stack, far beyond any drawing
    if (counts_.size() > 0 && ++depth_ > kDeepest)
      bad_file(file_.name, "block " + in_quotes(name), "blocks nested 200 deep", "fewer");
    counts_[name] = kOpen;
    std::size_t total = block.facets.triangles.size();
    for (const DxfInsert& insert : block.inserts) {
      const DxfBlock* inner = find(insert.block);
      if (!inner) continue;
      total += count(*inner, key_of(insert.block)) * insert.rows * insert.columns;
      if (total > kMostTriangles) {
        bad_file(file_.name, "block " + in_quotes(name),
                 "more than " + std::to_string(kMostTriangles) + " triangles by nested INSERTs", "fewer");
      }
    }
    if (depth_ > 0) --depth_;
    return counts_[name] = total;
  }

  void lay_out(const DxfBlock& block, const Eigen::Affine3d& place, Mesh& mesh, double scale) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Vec3& p : block.facets.vertices) {
      mesh.vertices.push_back(Vec3f((scale * (place * Eigen::Vector3d(p))).cast<float>()));
    }
    const bool mirrored = place.linear().determinant() < 0;
    for (auto t : block.facets.triangles) {
      if (mirrored) std::swap(t[1], t[2]);
      mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    for (const auto& [type, number] : block.ignored) ignored_[type] += number;
    too_smooth_ += block.too_smooth;
    for (const DxfInsert& insert : block.inserts) {
      const DxfBlock* inner = find(insert.block);
      if (!inner) {
        ++missing_;
        continue;
      }
      // A block without a surface adds nothing but its ignored entities, once however often it is put.
      const bool hollow = counts_.at(key_of(insert.block)) == 0;
      if (hollow && !seen_hollow_.insert({key_of(insert.block), true}).second) continue;
      for (std::size_t row = 0; row < (hollow ? 1 : insert.rows); ++row) {
        for (std::size_t column = 0; column < (hollow ? 1 : insert.columns); ++column) {
          Eigen::Affine3d inner_place = insert.place;
          inner_place.translation() +=
              static_cast<double>(row) * insert.row_step + static_cast<double>(column) * insert.column_step;
          lay_out(*inner, place * inner_place * Eigen::Translation3d(-inner->base), mesh, scale);
        }
      }
    }
  }

  const std::map<std::string, std::size_t>& ignored() const { return ignored_; }
  std::size_t missing() const { return missing_; }
  std::size_t too_smooth() const { return too_smooth_; }

 private:
  static constexpr std::size_t kOpen = static_cast<std::size_t>(-1);

  const DxfBlock* find(const std::string& name) const {
    const auto found = content_.blocks.find(key_of(name));
    return found == content_.blocks.end() ? nullptr : &found->second;
  }

  const FileBytes& file_;
  const DxfContent& content_;
  std::map<std::string, std::size_t> counts_;
  std::map<std::string, bool> seen_hollow_;
  std::map<std::string, std::size_t> ignored_;
  std::size_t depth_ = 0, missing_ = 0, too_smooth_ = 0;
};

/// Entities that carry a solid in ACIS' own format: without them the part would be incomplete, so they are refused.
void refuse_solids(const FileBytes& file, const std::map<std::string, std::size_t>& ignored) {
  for (const char* type : {"3DSOLID", "BODY", "SURFACE", "EXTRUDEDSURFACE", "LOFTEDSURFACE", "REVOLVEDSURFACE",
                           "SWEPTSURFACE", "PLANESURFACE", "NURBSURFACE", "ACAD_PROXY_ENTITY"}) {
    if (const auto found = ignored.find(type); found != ignored.end()) {
      bad_file(file.name, "section ENTITIES",
               std::to_string(found->second) + " " + type + " (ACIS data, not supported)",
               "faces or meshes; export STEP instead");
    }
  }
}

}  // namespace

Mesh parse_dxf(const FileBytes& file, bool& unit_known) {
  DxfGroups groups(file);
  DxfContent content;
  for (DxfGroup g = groups.next(); !(g.code == 0 && g.value == "EOF"); g = groups.next()) {
    if (g.code != 0 || g.value != "SECTION") groups.fail(g, in_quotes(g.value), "0 / SECTION or 0 / EOF");
    const DxfGroup name = groups.next();
    if (name.code != 2) groups.fail(name, "group " + std::to_string(name.code), "2 / the section's name");
    if (name.value == "HEADER") {
      read_header(groups, content);
    } else if (name.value == "BLOCKS") {
      read_blocks(groups, content);
    } else if (name.value == "ENTITIES") {
      content.model = read_dxf_entities(groups, "ENDSEC");
      content.has_model = true;
    } else {
      for (DxfGroup skipped = groups.next(); !(skipped.code == 0 && skipped.value == "ENDSEC");
           skipped = groups.next()) {
        if (skipped.code == 0 && skipped.value == "EOF") groups.fail(skipped, "\"EOF\"", "ENDSEC");
      }
    }
  }
  if (!content.has_model) bad_file(file.name, "", "no section ENTITIES", "one");
  unit_known = content.unit_mm > 0;
  Mesh mesh;
  Layout layout(file, content);
  layout.count(content.model, "");
  layout.lay_out(content.model, Eigen::Affine3d::Identity(), mesh, unit_known ? content.unit_mm : 1.0);
  refuse_solids(file, layout.ignored());
  std::string others;
  for (const auto& [type, number] : layout.ignored()) {
    others += (others.empty() ? "" : ", ") + std::to_string(number) + " " + in_quotes(type);
  }
  if (mesh.triangles.empty()) {
    bad_file(file.name, "section ENTITIES", others.empty() ? "nothing" : others + " and no surface",
             "3DFACE, polyface, polymesh, MESH, or INSERTs of them", ErrorCode::too_little_data);
  }
  if (!others.empty()) mesh.warnings.push_back("entities without a surface were left out: " + others);
  if (layout.missing())
    mesh.warnings.push_back(std::to_string(layout.missing()) +
                            " INSERTs of blocks that are not in the file were left out");
  if (layout.too_smooth())
    mesh.warnings.push_back(std::to_string(layout.too_smooth()) +
                            " MESHes were smoothed less often than the file says, for their size");
  return mesh;
}

}  // namespace tribin::io
