#pragma once

#include <filesystem>
#include <string>

#include "tribin/core/stage_times.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/part/part.hpp"

namespace tribin {

struct PartReadOptions {
  CadReadOptions cad;
  std::string name;             ///< of the part; empty = the file's stem
  std::filesystem::path cache;  ///< folder of compiled parts; empty = none is looked up or kept
};

/// Where a user's compiled parts lie: $XDG_CACHE_HOME/tribin/parts, else $HOME/.cache/tribin/parts; empty without both.
std::filesystem::path part_cache_folder();

/// Reads a CAD file and compiles it, or takes the compiled part from the cache; the two are equal in every bit.
///
/// An entry is named by a hash of the CAD file's bytes, its extension, the unit, and the sources of the program that
/// compiled it: a file that is edited, or another build, finds no old answer. An entry that is spoilt is ignored with a
/// warning and written anew; a folder that cannot be written is no error. Above 1 GiB those that were not used for
/// longest go.
/// \param times  gets "read" and "compile", or "load" for a part from the cache.
/// \throws Error as read_cad and compile_part.
Part read_part(const std::filesystem::path& path, const PartReadOptions& options = {}, StageTimes* times = nullptr);

}  // namespace tribin
