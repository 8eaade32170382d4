#include "tribin/cad_exchange/read_step.hpp"

#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_MakeSolid.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <BRep_Builder.hxx>
#include <Bnd_Box.hxx>
#include <IGESControl_Reader.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <mutex>

#include "cad_exchange/shape_mesh.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/cad_files.hpp"

namespace tribin {
namespace {

// Open CASCADE keeps its reader settings in global variables.
std::mutex g_open_cascade;

void check(const TessellationOptions& options) {
  if (!(options.chord_error_mm >= 1e-4 && options.chord_error_mm <= 10))
    throw Error(ErrorCode::bad_option,
                "chord_error_mm is " + std::to_string(options.chord_error_mm) + "; wanted 0.0001 to 10");
  if (!(options.angle > 0 && options.angle <= 1.5))
    throw Error(ErrorCode::bad_option, "angle is " + std::to_string(options.angle) + " rad; wanted above 0 to 1.5");
}

void check_start(const std::string& path, const std::string& wanted, std::size_t offset, const std::string& format) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path))
    throw Error(ErrorCode::bad_input, path + ": cannot be opened for reading");
  std::string start(256, '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  if (start.empty()) throw Error(ErrorCode::bad_input, path + ": the file is empty; wanted " + format);
  const std::size_t found = start.find(wanted, offset);
  if (found == std::string::npos || (offset > 0 && found != offset)) {
    std::string seen = start.substr(0, 20);
    for (char& c : seen)
      if (c < ' ' || c > '~') c = '.';
    throw Error(ErrorCode::bad_input, path + ": starts with \"" + seen + "\"; wanted " + format);
  }
}

/// Gaps between the loose faces of CAD writers stay below 0.01 mm; on a part of some mm that would close what is open.
double sewing_tolerance(const TopoDS_Shape& shape) {
  Bnd_Box box;
  BRepBndLib::AddClose(shape, box);
  return box.IsVoid() ? 1e-2 : std::min(1e-2, 1e-4 * std::sqrt(box.SquareExtent()));
}

/// Shells that are closed become solids, so that their orientation is known.
TopoDS_Shape solids_of_sewn(const TopoDS_Shape& sewn) {
  TopoDS_Compound compound;
  BRep_Builder builder;
  builder.MakeCompound(compound);
  for (TopExp_Explorer shells(sewn, TopAbs_SHELL); shells.More(); shells.Next()) {
    const TopoDS_Shell& shell = TopoDS::Shell(shells.Current());
    if (shell.Closed())
      builder.Add(compound, BRepBuilderAPI_MakeSolid(shell).Solid());
    else
      builder.Add(compound, shell);
  }
  for (TopExp_Explorer faces(sewn, TopAbs_FACE, TopAbs_SHELL); faces.More(); faces.Next())
    builder.Add(compound, faces.Current());
  return compound;
}

Mesh named_mesh(const std::string& path, const TopoDS_Shape& shape, const TessellationOptions& options) {
  try {
    return detail::mesh_of_shape(shape, options);
  } catch (const Error& error) {
    throw Error(error.code(), path + ": " + error.what());
  }
}

template <class Reader>
Mesh read(const std::string& path, const TessellationOptions& options, const std::string& format) {
  const std::lock_guard lock(g_open_cascade);
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));  // a library does not print
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  try {
    Reader reader;
    if (reader.ReadFile(path.c_str()) != IFSelect_RetDone)
      throw Error(ErrorCode::bad_input, path + ": its entities cannot be parsed as " + format);
    reader.TransferRoots();
    TopoDS_Shape shape = reader.OneShape();
    if (!shape.IsNull() && TopExp_Explorer(shape, TopAbs_FACE).More()) {
      if (!TopExp_Explorer(shape, TopAbs_SOLID).More()) {
        BRepBuilderAPI_Sewing sewing(sewing_tolerance(shape));
        sewing.Add(shape);
        sewing.Perform();
        if (!sewing.SewedShape().IsNull()) shape = solids_of_sewn(sewing.SewedShape());
      }
      Mesh mesh = named_mesh(path, shape, options);
      mesh.name = std::filesystem::path(path).stem().string();
      if (!mesh.triangles.empty()) return mesh;
    }
    throw Error(ErrorCode::bad_input,
                path + ": read as " + format + ", but there is no face in it; wanted a solid or a shell");
  } catch (const Standard_Failure& failure) {
    throw Error(ErrorCode::bad_input, path + ": cannot be read as " + format + ": " + failure.GetMessageString());
  }
}

}  // namespace

Mesh read_step(const std::string& path, const TessellationOptions& options) {
  check(options);
  check_start(path, "ISO-10303-21", 0, "a STEP file (ISO-10303-21)");
  return read<STEPControl_Reader>(path, options, "a STEP file");
}

Mesh read_iges(const std::string& path, const TessellationOptions& options) {
  check(options);
  check_start(path, "S", 72, "an IGES file (\"S\" in column 73)");
  return read<IGESControl_Reader>(path, options, "an IGES file");
}

void register_cad_exchange() {
  // The unit is the file's own: CadReadOptions::unit is for formats without one.
  for (const char* extension : {".step", ".stp"})
    register_cad_reader(extension, [](const auto& path, const CadReadOptions&) { return read_step(path.string()); });
  for (const char* extension : {".iges", ".igs"})
    register_cad_reader(extension, [](const auto& path, const CadReadOptions&) { return read_iges(path.string()); });
}

}  // namespace tribin
