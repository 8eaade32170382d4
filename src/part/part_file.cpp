#include "tribin/part/part_file.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "part/part_fields.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using namespace part_detail;

static_assert(std::endian::native == std::endian::little);

constexpr std::string_view kMagic = "tribpart";
constexpr std::size_t kHeader = 56;

class Writer {
 public:
  explicit Writer(std::string& out) : out_(out) {}

  template <class... T>
  void operator()(const T&... fields) {
    (add(fields), ...);
  }

 private:
  template <class T>
  void add(const T& value) {
    if constexpr (IsFlat<T>::value) {
      raw(&value, sizeof value);
    } else if constexpr (std::is_enum_v<T> || std::same_as<T, bool>) {
      out_ += static_cast<char>(value);
    } else {
      each_field(*this, value);
    }
  }
  void add(const std::string& text) {
    add(std::uint64_t{text.size()});
    out_ += text;
  }
  template <class T>
  void add(const std::optional<T>& value) {
    add(value.has_value());
    if (value) add(*value);
  }
  template <class T>
  void add(const std::vector<T>& list) {
    add(std::uint64_t{list.size()});
    if constexpr (IsFlat<T>::value) {
      raw(list.data(), list.size() * sizeof(T));
    } else {
      for (const T& element : list) add(element);
    }
  }
  void raw(const void* bytes, std::size_t size) { out_.append(static_cast<const char*>(bytes), size); }

  std::string& out_;
};

[[noreturn]] void fail(std::size_t at, const std::string& seen, const std::string& wanted) {
  throw Error(ErrorCode::bad_input, "byte " + std::to_string(at) + ": saw " + seen + ", wanted " + wanted);
}

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  template <class... T>
  void operator()(T&... fields) {
    (take(fields), ...);
  }
  std::size_t at() const { return at_; }

 private:
  template <class T>
  void take(T& value) {
    if constexpr (IsFlat<T>::value) {
      raw(&value, sizeof value);
    } else if constexpr (std::same_as<T, bool>) {
      value = byte(1) != 0;
    } else if constexpr (std::is_enum_v<T>) {
      value = static_cast<T>(byte(static_cast<std::uint8_t>(last_of(T{}))));
    } else {
      each_field(*this, value);
    }
  }
  void take(std::string& text) {
    text.resize(count(1));
    raw(text.data(), text.size());
  }
  template <class T>
  void take(std::optional<T>& value) {
    bool has = false;
    take(has);
    if (has) take(value.emplace());
  }
  template <class T>
  void take(std::vector<T>& list) {
    if constexpr (IsFlat<T>::value) {
      list.resize(count(sizeof(T)));
      raw(list.data(), list.size() * sizeof(T));
    } else {
      // An element takes a byte at least; its place in memory is made when its bytes have come.
      const std::size_t size = count(1);
      list.reserve(std::min<std::size_t>(size, 4096));
      for (std::size_t i = 0; i < size; ++i) take(list.emplace_back());
    }
  }

  std::uint8_t byte(std::uint8_t largest) {
    std::uint8_t value = 0;
    raw(&value, 1);
    if (value > largest) fail(at_ - 1, std::to_string(value), "0.." + std::to_string(largest));
    return value;
  }
  std::size_t count(std::size_t element_bytes) {
    std::uint64_t value = 0;
    raw(&value, sizeof value);
    if (value > (bytes_.size() - at_) / element_bytes)
      fail(at_ - 8, std::to_string(value) + " elements", "no more than the bytes behind hold");
    return static_cast<std::size_t>(value);
  }
  void raw(void* to, std::size_t size) {
    if (size > bytes_.size() - at_) fail(at_, "the end", std::to_string(size) + " bytes more");
    if (size > 0) std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
};

/// Are all indices within what they point into? Then no use of the part can leave its memory.
bool is_sound(const Part& part) {
  const auto below = [](const auto& list, std::size_t end) {
    return std::all_of(list.begin(), list.end(), [&](const auto& i) { return static_cast<std::size_t>(i) < end; });
  };
  const auto all_below = [&](const auto& triples, std::size_t end) {
    return std::all_of(triples.begin(), triples.end(), [&](const auto& t) { return below(t, end); });
  };
  const std::size_t triangles = part.mesh.triangles.size(), primitives = part.model.primitives.size();
  bool sound = triangles > 0 && all_below(part.mesh.triangles, part.mesh.vertices.size()) &&
               (part.mesh.face_of_triangle.empty() || part.mesh.face_of_triangle.size() == triangles) &&
               part.render_mesh.triangles.size() == triangles && part.primitive_of_triangle.size() == triangles &&
               below(part.primitive_of_triangle, primitives + 1) && part.exposed_mm2.size() == primitives &&
               !part.symmetry.discrete.empty() && !part.views.empty();
  for (const RenderMesh* render : {&part.render_mesh, &part.coarse_mesh}) {
    const std::size_t count = render->triangles.size();
    sound = sound && render->normals.size() == count && render->offsets.size() == count &&
            all_below(render->triangles, render->vertices.size());
    for (const OutlineEdge& e : render->edges) {
      sound = sound && below(e.vertices, render->vertices.size());
      for (std::int32_t t : e.triangles) sound = sound && t >= -1 && t < static_cast<std::int64_t>(count);
    }
  }
  for (std::size_t i = 0; i < primitives; ++i) {
    const Primitive& p = part.model.primitives[i];
    sound = sound && p.id == static_cast<int>(i) + 1 && below(p.surfels, triangles);
  }
  const auto is_id = [&](int id) { return id >= 1 && static_cast<std::size_t>(id) <= primitives; };
  for (const Relation& r : part.model.relations) sound = sound && is_id(r.first) && is_id(r.second);
  for (const PartView& v : part.views) sound = sound && v.normals.size() == v.points.size();
  // A pair of samples keeps its first one in 16 bits.
  sound = sound && part.sample_normals.size() == part.sample_points.size() && part.sample_points.size() <= 65535;
  return sound;
}

}  // namespace

std::string bytes_of_part(const Part& part, const ContentHash& key) {
  std::string out(kHeader, '\0');
  Writer{out}(part);
  const std::uint64_t size = out.size() - kHeader;
  const ContentHash check = content_hash(std::string_view(out).substr(kHeader));
  std::memcpy(out.data(), kMagic.data(), kMagic.size());
  std::memcpy(out.data() + 8, &kPartFileVersion, 4);
  std::memcpy(out.data() + 16, &key, 16);
  std::memcpy(out.data() + 32, &check, 16);
  std::memcpy(out.data() + 48, &size, 8);
  return out;
}

Part part_from_bytes(std::string_view bytes, const ContentHash& key) {
  if (!bytes.starts_with(kMagic)) fail(0, "something else", "a compiled part (\"tribpart\")");
  if (bytes.size() < kHeader) fail(bytes.size(), "the end", "a header of 56 bytes");
  std::uint32_t version = 0;
  ContentHash made_from, check;
  std::uint64_t size = 0;
  std::memcpy(&version, bytes.data() + 8, 4);
  std::memcpy(&made_from, bytes.data() + 16, 16);
  std::memcpy(&check, bytes.data() + 32, 16);
  std::memcpy(&size, bytes.data() + 48, 8);
  if (version != kPartFileVersion)
    fail(8, "version " + std::to_string(version), "version " + std::to_string(kPartFileVersion));
  if (made_from != key) fail(16, "key " + hex_of(made_from), hex_of(key));
  const std::string_view payload = bytes.substr(kHeader);
  if (size != payload.size())
    fail(48, std::to_string(size) + " bytes claimed and " + std::to_string(payload.size()) + " there", "as many");
  if (content_hash(payload) != check) fail(32, "a checksum that the payload does not have", "its own");
  Reader reader(payload);
  Part part;
  reader(part);
  if (reader.at() != payload.size())
    fail(kHeader + reader.at(), std::to_string(payload.size() - reader.at()) + " bytes more", "the end");
  if (!is_sound(part)) fail(kHeader, "a part whose indices point beyond its lists", "a whole one");
  return part;
}

}  // namespace tribin
