#include "tribin/io/cad_files.hpp"

#include <map>
#include <mutex>

#include "io/mesh_formats.hpp"
#include "tribin/cad/mend.hpp"

namespace tribin {
namespace {

struct Registry {
  std::mutex mutex;
  std::map<std::string, CadReader> readers;
};

Registry& registry() {
  static Registry instance;
  return instance;
}

/// Mesh formats by extension; `unit_known` is set by a format that names its unit (it comes in mm then).
using Parser = Mesh (*)(const io::FileBytes&, bool& unit_known);

const std::map<std::string, Parser>& parsers() {
  static const std::map<std::string, Parser> table = {
      {".stl", [](const io::FileBytes& file, bool&) { return io::parse_stl(file); }},
      {".ply", [](const io::FileBytes& file, bool&) { return io::parse_ply_mesh(file); }},
      {".obj", [](const io::FileBytes& file, bool&) { return io::parse_obj(file); }},
      {".dxf", io::parse_dxf},
  };
  return table;
}

CadReader registered(const std::string& extension) {
  const std::lock_guard lock(registry().mutex);
  const auto found = registry().readers.find(extension);
  return found == registry().readers.end() ? CadReader{} : found->second;
}

}  // namespace

void register_cad_reader(const std::string& extension, CadReader reader) {
  const std::lock_guard lock(registry().mutex);
  registry().readers[extension] = std::move(reader);
}

std::vector<std::string> cad_extensions() {
  std::vector<std::string> extensions;
  for (const auto& [extension, parser] : parsers()) extensions.push_back(extension);
  const std::lock_guard lock(registry().mutex);
  for (const auto& [extension, reader] : registry().readers) extensions.push_back(extension);
  return extensions;
}

Mesh read_cad(const std::filesystem::path& path, const CadReadOptions& options) {
  const std::string extension = io::lower_extension(path);
  if (const CadReader reader = registered(extension)) return reader(path, options);
  for (const char* exact : {".step", ".stp", ".iges", ".igs"}) {
    if (extension == exact) {
      throw Error(ErrorCode::bad_option, path.string() +
                                             ": STEP and IGES need the component cad_exchange, which is not built in: "
                                             "install libocct-data-exchange-dev and build again, or export STL");
    }
  }
  const auto parser = parsers().find(extension);
  if (parser == parsers().end()) {
    std::string known;
    for (const std::string& e : cad_extensions()) known += (known.empty() ? "" : " ") + e;
    io::bad_file(path.string(), "", "extension " + io::in_quotes(extension), "a CAD file (" + known + ")");
  }
  bool unit_known = false;
  Mesh mesh = parser->second(io::read_file(path), unit_known);
  const LengthUnit unit = options.unit == LengthUnit::automatic ? LengthUnit::millimetre : options.unit;
  const auto scale = static_cast<float>(millimetres_in(unit));
  if (unit_known && options.unit != LengthUnit::automatic && scale != 1) {
    mesh.warnings.push_back("the file names its own unit; the unit " + std::string(name_of(unit)) + " is not used");
  }
  if (!unit_known && scale != 1) {
    for (Vec3f& p : mesh.vertices) p *= scale;
  }
  mesh.name = path.stem().string();
  try {
    mend_mesh(mesh);
  } catch (const Error& error) {
    throw Error(error.code(), path.string() + ": " + error.what());
  }
  return mesh;
}

}  // namespace tribin
