#include "io/ply.hpp"

#include <cmath>
#include <limits>

#include "io/ply_header.hpp"
#include "io/text_cursor.hpp"

namespace tribin::io {
namespace {

/// Reads the numbers of a body one by one, whichever form it has.
class PlyBody {
 public:
  PlyBody(const FileBytes& file, const PlyHeader& header)
      : file_(file),
        ascii_(header.format == PlyHeader::Format::ascii),
        swapped_((header.format == PlyHeader::Format::binary_big_endian) != kBigEndianHost),
        text_(file, header.body),
        at_(header.body) {}

  bool ascii() const { return ascii_; }
  bool swapped() const { return swapped_; }
  std::size_t position() const { return ascii_ ? text_.position() : at_; }
  /// "line 12" or "byte 345"; counts lines, so that it is only for a failure.
  std::string place(std::size_t position) const { return ascii_ ? at_line(file_.view(), position) : at_byte(position); }

  double number(Scalar type) {
    if (ascii_) return text_.number<double>("a number");
    return load_scalar(take(size_of(type)), type, swapped_);
  }

  /// The next bytes of a binary body.
  const char* take(std::size_t count) {
    if (count > file_.size() - at_) {
      bad_file(file_.name, at_byte(at_), "the end of the file", std::to_string(count) + " bytes more");
    }
    at_ += count;
    return file_.data.data() + at_ - count;
  }

  std::size_t left() const { return file_.size() - position(); }

  /// The length of a list; checked, since each of its items takes at least a byte.
  std::size_t list_size(const PlyProperty& property) {
    const std::size_t begin = position();
    const double count = number(property.count_type);
    if (!(count >= 0) || count != std::floor(count) || count > static_cast<double>(left())) {
      bad_file(file_.name, place(begin), "a list of " + std::to_string(count) + " items",
               "a count that the file can hold");
    }
    return static_cast<std::size_t>(count);
  }

  void skip(const PlyElement& element) {
    for (const PlyProperty& p : element.properties) skip(p);
  }

  void skip(const PlyProperty& p) {
    std::size_t count = p.is_list ? list_size(p) : 1;
    if (!ascii_) {
      take(count * size_of(p.type));
    } else {
      while (count-- > 0) text_.number<double>("a number");
    }
  }

 private:
  const FileBytes& file_;
  bool ascii_;
  bool swapped_;
  TextCursor text_;
  std::size_t at_;
};

void read_points(const FileBytes& file, const PlyElement& element, PlyBody& body, PlyContent& content) {
  const int column[3] = {element.find("x"), element.find("y"), element.find("z")};
  for (int c = 0; c < 3; ++c) {
    if (column[c] < 0 || element.properties[column[c]].is_list) {
      bad_file(file.name, "element \"vertex\"", "no property " + std::string(1, "xyz"[c]), "properties x, y and z");
    }
  }
  content.points.resize(element.count);
  if (!body.ascii() && !element.has_list()) {
    std::size_t offset[3];
    for (int c = 0; c < 3; ++c) {
      offset[c] = 0;
      for (int i = 0; i < column[c]; ++i) offset[c] += size_of(element.properties[i].type);
    }
    const std::size_t stride = element.least_bytes();
    const char* data = body.take(stride * element.count);
    const Scalar types[3] = {element.properties[column[0]].type, element.properties[column[1]].type,
                             element.properties[column[2]].type};
    const bool plain = !body.swapped() && types[0] == Scalar::f32 && types[1] == Scalar::f32 && types[2] == Scalar::f32;
    for (Vec3f& p : content.points) {
      for (int c = 0; c < 3; ++c) {
        p[c] = plain ? load<float>(data + offset[c])
                     : static_cast<float>(load_scalar(data + offset[c], types[c], body.swapped()));
      }
      data += stride;
    }
    return;
  }
  for (Vec3f& p : content.points) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (property.is_list) {
        body.skip(property);
        continue;
      }
      const double value = body.number(property.type);
      for (int c = 0; c < 3; ++c) {
        if (column[c] == static_cast<int>(i)) p[c] = static_cast<float>(value);
      }
    }
  }
}

std::uint32_t read_index(const FileBytes& file, const PlyProperty& property, PlyBody& body, std::size_t points) {
  const std::size_t begin = body.position();
  const double index = body.number(property.type);
  if (!(index >= 0 && index < static_cast<double>(points)) || index != std::floor(index)) {
    bad_file(file.name, body.place(begin), "vertex number " + std::to_string(index),
             "a whole number in 0.." + std::to_string(points) + " (not included)");
  }
  return static_cast<std::uint32_t>(index);
}

int index_list(const FileBytes& file, const PlyElement& element) {
  for (const char* name : {"vertex_indices", "vertex_index"}) {
    const int found = element.find(name);
    if (found >= 0 && element.properties[found].is_list) return found;
  }
  bad_file(file.name, "element " + in_quotes(element.name), "no list vertex_indices", "one");
}

void read_polygons(const FileBytes& file, const PlyElement& element, PlyBody& body, PlyContent& content) {
  const int list = element.count ? index_list(file, element) : -1;
  content.polygon_sizes.reserve(element.count);
  content.corners.reserve(3 * element.count);
  for (std::size_t n = 0; n < element.count; ++n) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (static_cast<int>(i) != list) {
        body.skip(property);
        continue;
      }
      const std::size_t size = body.list_size(property);
      for (std::size_t k = 0; k < size; ++k) {
        content.corners.push_back(read_index(file, property, body, content.points.size()));
      }
      content.polygon_sizes.push_back(static_cast<std::uint32_t>(size));
    }
  }
}

/// Stanford's range grid: for each pixel the number of its vertex, or none.
void read_range_grid(const FileBytes& file, const PlyElement& element, PlyBody& body, PlyContent& content) {
  const int list = index_list(file, element);
  std::vector<Vec3f> grid(element.count, Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  for (Vec3f& pixel : grid) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (static_cast<int>(i) != list) {
        body.skip(property);
        continue;
      }
      const std::size_t size = body.list_size(property);
      for (std::size_t k = 0; k < size; ++k) {
        pixel = content.points[read_index(file, property, body, content.points.size())];
      }
    }
  }
  content.points = std::move(grid);
}

}  // namespace

PlyContent parse_ply(const FileBytes& file) {
  const PlyHeader header = parse_ply_header(file);
  PlyBody body(file, header);
  PlyContent content;
  bool has_points = false;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex" && !has_points) {
      read_points(file, element, body, content);
      has_points = true;
    } else if (element.name == "face" && has_points && content.polygon_sizes.empty()) {
      read_polygons(file, element, body, content);
    } else if (element.name == "range_grid" && has_points && element.count == header.columns * header.rows &&
               element.count > 0) {
      read_range_grid(file, element, body, content);
    } else if (element.count > 0 && element.least_bytes() > 0) {
      for (std::size_t i = 0; i < element.count; ++i) body.skip(element);
    }
  }
  if (!has_points) bad_file(file.name, "header", "no element vertex", "one with x, y and z");
  if (header.columns * header.rows > 0) {
    if (header.columns > 65535 || header.rows > 65535 || header.columns * header.rows != content.points.size()) {
      bad_file(file.name, "header",
               "a grid of " + std::to_string(header.columns) + " x " + std::to_string(header.rows) + " and " +
                   std::to_string(content.points.size()) + " points",
               "as many points as the grid has");
    }
    content.width = static_cast<int>(header.columns);
    content.height = static_cast<int>(header.rows);
  }
  return content;
}

}  // namespace tribin::io
