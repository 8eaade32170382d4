#include "tribin/io/part_cache.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "io/atomic_file.hpp"
#include "io/file_bytes.hpp"
#include "io/part_fingerprint.hpp"  // made by the build: kPartFingerprint
#include "tribin/core/log.hpp"
#include "tribin/part/part_file.hpp"

namespace tribin {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLargestCache = std::uintmax_t{1} << 30;  // some hundred parts

/// What the compiled part depends on: the file's bytes, the reader that the extension chooses, the unit, the program.
ContentHash key_of(const io::FileBytes& file, const fs::path& path, const PartReadOptions& options) {
  const std::string context = io::lower_extension(path) + "\n" + std::string(name_of(options.cad.unit)) + "\n" +
                              kPartFingerprint + "\n" + hex_of(content_hash(file.view()));
  return content_hash(context);
}

std::optional<Part> loaded(const fs::path& entry, const ContentHash& key) {
  std::error_code none;
  if (!fs::exists(entry, none)) return {};
  try {
    Part part = part_from_bytes(io::read_file(entry).view(), key);
    fs::last_write_time(entry, fs::file_time_type::clock::now(), none);  // the oldest go first
    return part;
  } catch (const Error& error) {
    log(LogLevel::warning, entry.string() + ": " + error.what() + "; the entry is made anew");
  }
  return {};
}

/// Removes the entries that were not used for longest until the rest is small enough.
void shrink(const fs::path& folder) {
  struct Entry {
    fs::file_time_type used;
    fs::path path;
    std::uintmax_t size;
  };
  std::vector<Entry> entries;
  std::uintmax_t total = 0;
  std::error_code none;
  for (fs::directory_iterator at(folder, none), end; !none && at != end; at.increment(none)) {
    std::error_code gone;  // another process may shrink the same folder
    const Entry entry{at->last_write_time(gone), at->path(), at->file_size(gone)};
    if (gone || at->path().extension() != ".part") continue;
    total += entry.size;
    entries.push_back(entry);
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.used < b.used; });
  for (const Entry& entry : entries) {
    if (total <= kLargestCache) return;
    fs::remove(entry.path, none);
    total -= entry.size;
  }
}

void keep(const fs::path& folder, const fs::path& entry, const Part& part, const ContentHash& key) {
  std::error_code error;
  fs::create_directories(folder, error);
  try {
    io::write_file(entry, bytes_of_part(part, key));
    shrink(folder);
  } catch (const Error& failure) {
    log(LogLevel::info, std::string("the compiled part is not kept: ") + failure.what());
  }
}

Part compiled(const fs::path& path, const PartReadOptions& options, StageTimes& times) {
  Mesh mesh;
  {
    const StageTimer timer(times, "read");
    mesh = read_cad(path, options.cad);
  }
  const StageTimer timer(times, "compile");
  return compile_part(mesh);
}

}  // namespace

fs::path part_cache_folder() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return fs::path(value ? value : "");
  };
  // A relative XDG_CACHE_HOME is to be ignored, says the XDG base directory specification.
  if (const fs::path base = variable("XDG_CACHE_HOME"); base.is_absolute()) return base / "tribin" / "parts";
  if (const fs::path home = variable("HOME"); home.is_absolute()) return home / ".cache" / "tribin" / "parts";
  return {};
}

Part read_part(const fs::path& path, const PartReadOptions& options, StageTimes* times) {
  StageTimes own;
  StageTimes& clock = times ? *times : own;
  const std::vector<std::string> known = cad_extensions();
  const bool readable = std::find(known.begin(), known.end(), io::lower_extension(path)) != known.end();
  Part part;
  if (options.cache.empty() || !readable) {  // what is not readable is read_cad's to refuse
    part = compiled(path, options, clock);
  } else {
    ContentHash key;
    fs::path entry;
    std::optional<Part> found;
    {
      const StageTimer timer(clock, "load");
      key = key_of(io::read_file(path), path, options);
      entry = options.cache / (hex_of(key) + ".part");
      found = loaded(entry, key);
    }
    if (found) {
      part = std::move(*found);
      log(LogLevel::info, path.filename().string() + ": compiled part " + entry.string());
    } else {
      part = compiled(path, options, clock);
      keep(options.cache, entry, part, key);
    }
  }
  part.mesh.name = path.stem().string();  // the same content may lie under another name
  part.name = options.name.empty() ? part.mesh.name : options.name;
  return part;
}

}  // namespace tribin
