#include <cmath>

#include "io/binary.hpp"
#include "io/lzf.hpp"
#include "io/raw_cloud.hpp"
#include "io/text_cursor.hpp"

namespace tribin::io {
namespace {

struct PcdField {
  std::string name;
  std::size_t size = 4;
  char type = 'F';
  std::size_t count = 1;
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::size_t width = 0, height = 1, points = 0;
  bool has_width = false, has_points = false;
  std::optional<Pose> viewpoint;
  std::string data;
  std::size_t body = 0;

  std::size_t stride() const {
    std::size_t bytes = 0;
    for (const PcdField& f : fields) bytes += f.size * f.count;
    return bytes;
  }
  std::size_t columns() const {
    std::size_t n = 0;
    for (const PcdField& f : fields) n += f.count;
    return n;
  }
};

std::size_t count_of(const FileBytes& file, const std::string& place, std::string_view word) {
  std::size_t value = 0;
  if (!whole_number(word, value) || value > 0xffffffffu) {
    bad_file(file.name, place, in_quotes(word), "a whole number >= 0");
  }
  return value;
}

Pose viewpoint_of(const FileBytes& file, const std::string& place, const std::vector<std::string_view>& words) {
  double v[7];
  bool good = words.size() == 8;
  for (int i = 0; i < 7 && good; ++i) good = whole_number(words[i + 1], v[i]) && std::isfinite(v[i]);
  if (!good) bad_file(file.name, place, "VIEWPOINT without 7 numbers", "VIEWPOINT tx ty tz qw qx qy qz");
  const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
  if (std::abs(q.norm() - 1) > 0.01) {
    bad_file(file.name, place, "VIEWPOINT with a quaternion of length " + std::to_string(q.norm()), "length 1");
  }
  Pose pose = Pose::Identity();
  pose.linear() = q.normalized().toRotationMatrix();
  pose.translation() = Vec3(v[0], v[1], v[2]);
  return pose;
}

void check_field(const FileBytes& file, const std::string& place, const PcdField& f) {
  const bool known = f.type == 'F'                    ? f.size == 4 || f.size == 8
                     : f.type == 'I' || f.type == 'U' ? f.size == 1 || f.size == 2 || f.size == 4 || f.size == 8
                                                      : false;
  if (!known) {
    bad_file(file.name, place,
             "field " + in_quotes(f.name) + " of type " + in_quotes(std::string(1, f.type)) + " and size " +
                 std::to_string(f.size),
             "F 4|8, I or U 1|2|4|8");
  }
}

PcdHeader parse_header(const FileBytes& file) {
  PcdHeader header;
  TextCursor cursor(file);
  std::string place;
  for (std::string_view line; header.data.empty();) {
    place = cursor.place();
    if (!cursor.next_line(line)) bad_file(file.name, place, "the end of the file", "a PCD header that ends with DATA");
    const auto words = words_of(line);
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::string_view key = words[0];
    const std::size_t n = words.size() - 1;
    const bool per_field = key == "SIZE" || key == "TYPE" || key == "COUNT";
    if (per_field && n != header.fields.size()) {
      bad_file(file.name, place, std::to_string(n) + " entries of " + std::string(key),
               std::to_string(header.fields.size()) + ", one a field");
    }
    if (key == "VERSION") {
      continue;
    } else if (key == "FIELDS" || key == "COLUMNS") {
      for (std::size_t i = 1; i <= n; ++i) header.fields.push_back({std::string(words[i])});
    } else if (per_field) {
      for (std::size_t i = 0; i < n; ++i) {
        PcdField& f = header.fields[i];
        if (key == "TYPE") f.type = words[i + 1][0];
        if (key == "SIZE") f.size = count_of(file, place, words[i + 1]);
        if (key == "COUNT") f.count = count_of(file, place, words[i + 1]);
        if (f.count > 100'000) bad_file(file.name, place, in_quotes(words[i + 1]), "a COUNT below 100000");
      }
    } else if ((key == "WIDTH" || key == "HEIGHT" || key == "POINTS") && n == 1) {
      const std::size_t value = count_of(file, place, words[1]);
      if (key == "WIDTH") header.width = value, header.has_width = true;
      if (key == "HEIGHT") header.height = value;
      if (key == "POINTS") header.points = value, header.has_points = true;
    } else if (key == "VIEWPOINT") {
      header.viewpoint = viewpoint_of(file, place, words);
    } else if (key == "DATA" && n == 1) {
      header.data = words[1];
    } else {
      bad_file(file.name, place, in_quotes(line), "a line of a PCD header (FIELDS .. DATA)");
    }
  }
  header.body = cursor.position();
  for (const PcdField& f : header.fields) check_field(file, "header", f);
  if (!header.has_points) header.points = header.width * header.height;
  if (!header.has_width) header.width = header.points;
  if (header.width * header.height != header.points || header.points > kMaxPoints) {
    bad_file(file.name, "header",
             "POINTS " + std::to_string(header.points) + " and a grid of " + std::to_string(header.width) + " x " +
                 std::to_string(header.height),
             "POINTS = WIDTH x HEIGHT, at most " + std::to_string(kMaxPoints));
  }
  if (header.points == 0) bad_file(file.name, "header", "no points", "points", ErrorCode::too_little_data);
  return header;
}

Scalar scalar_of(const PcdField& f) {
  if (f.type == 'F') return f.size == 4 ? Scalar::f32 : Scalar::f64;
  const int power = f.size == 1 ? 0 : f.size == 2 ? 1 : f.size == 4 ? 2 : 3;
  return static_cast<Scalar>(2 * power + (f.type == 'U'));
}

/// Where x, y and z are: at `start + i * step` for point i.
struct PcdColumn {
  std::size_t start = 0, step = 0, word = 0;
  Scalar type = Scalar::f32;
};

std::array<PcdColumn, 3> columns_of(const FileBytes& file, const PcdHeader& header, bool field_by_field) {
  std::array<PcdColumn, 3> columns;
  for (int c = 0; c < 3; ++c) {
    std::size_t offset = 0, word = 0;
    bool found = false;
    for (const PcdField& f : header.fields) {
      if (f.name.size() == 1 && f.name[0] == "xyz"[c] && f.count == 1) {
        columns[c] = {field_by_field ? offset * header.points : offset, field_by_field ? f.size : header.stride(), word,
                      scalar_of(f)};
        found = true;
        break;
      }
      offset += f.size * f.count;
      word += f.count;
    }
    if (!found) bad_file(file.name, "FIELDS", "no field " + std::string(1, "xyz"[c]), "x, y and z, COUNT 1 each");
  }
  return columns;
}

void read_binary(const char* data, const std::array<PcdColumn, 3>& columns, std::vector<Vec3f>& points) {
  bool plain = !kBigEndianHost;
  for (const PcdColumn& c : columns) plain = plain && c.type == Scalar::f32;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const char* at = data + columns[c].start + i * columns[c].step;
      points[i][c] = plain ? load<float>(at) : static_cast<float>(load_scalar(at, columns[c].type, kBigEndianHost));
    }
  }
}

void read_ascii(const FileBytes& file, const PcdHeader& header, const std::array<PcdColumn, 3>& columns,
                std::vector<Vec3f>& points) {
  TextCursor cursor(file, header.body);
  const std::size_t wanted = header.columns();
  std::string_view line;
  std::size_t read = 0;
  for (std::size_t begin = cursor.position(); cursor.next_line(line); begin = cursor.position()) {
    std::size_t word = 0;
    for (std::size_t at = 0; at < line.size();) {
      while (at < line.size() && TextCursor::is_space(line[at])) ++at;
      const std::size_t from = at;
      while (at < line.size() && !TextCursor::is_space(line[at])) ++at;
      if (from == at) break;
      if (read == points.size())
        bad_file(file.name, at_line(file.view(), begin), "one more point", "POINTS " + std::to_string(points.size()));
      for (int c = 0; c < 3; ++c) {
        if (columns[c].word != word) continue;
        const std::string_view text = line.substr(from, at - from);
        if (!whole_number(text, points[read][c])) {
          bad_file(file.name, at_line(file.view(), begin), in_quotes(text), "a coordinate");
        }
      }
      ++word;
    }
    if (word == 0) continue;
    if (word != wanted) {
      bad_file(file.name, at_line(file.view(), begin), std::to_string(word) + " values",
               std::to_string(wanted) + ", as FIELDS and COUNT say");
    }
    ++read;
  }
  if (read != points.size()) {
    bad_file(file.name, at_line(file.view(), file.size()),
             "the end of the file after " + std::to_string(read) + " points",
             "POINTS " + std::to_string(points.size()));
  }
}

std::string unpacked(const FileBytes& file, const PcdHeader& header) {
  const std::string_view body = file.view().substr(header.body);
  const std::size_t bytes = header.stride() * header.points;
  if (body.size() < 8) bad_file(file.name, at_byte(header.body), "the end of the file", "the sizes of compressed data");
  const std::size_t packed = load<std::uint32_t>(body.data(), kBigEndianHost);
  const std::size_t claimed = load<std::uint32_t>(body.data() + 4, kBigEndianHost);
  if (claimed != bytes) {
    bad_file(file.name, at_byte(header.body + 4), std::to_string(claimed) + " bytes of data",
             std::to_string(bytes) + " (POINTS times the size of the fields)");
  }
  if (packed > body.size() - 8 || bytes > packed * kLzfMostRatio) {
    bad_file(file.name, at_byte(header.body),
             std::to_string(packed) + " compressed bytes for " + std::to_string(bytes) + ", of which " +
                 std::to_string(body.size() - 8) + " are there",
             "as many as the file has and the data needs");
  }
  std::string out(bytes, '\0');
  const std::size_t wrong = unpack_lzf(body.substr(8, packed), out);
  if (wrong != std::string::npos) {
    bad_file(file.name, at_byte(header.body + 8 + wrong), "a broken LZF stream",
             std::to_string(bytes) + " bytes of data");
  }
  return out;
}

}  // namespace

RawCloud parse_pcd(const FileBytes& file) {
  const PcdHeader header = parse_header(file);
  RawCloud cloud{.name = file.name,
                 .width = static_cast<int>(header.width),
                 .height = static_cast<int>(header.height),
                 .points = {},
                 .viewpoint = header.viewpoint,
                 .taken = {},
                 .warnings = {}};
  const auto columns = columns_of(file, header, header.data == "binary_compressed");
  const std::size_t left = file.size() - header.body,
                    least = header.data == "ascii" ? 2 * header.columns() : header.stride();
  if (header.data == "binary_compressed") {
    const std::string data = unpacked(file, header);
    cloud.points.resize(header.points);
    read_binary(data.data(), columns, cloud.points);
  } else if (header.data == "binary" || header.data == "ascii") {
    if (least * header.points > left + 1) {
      bad_file(file.name, at_byte(header.body),
               std::to_string(header.points) + " points in " + std::to_string(left) + " bytes",
               "at least " + std::to_string(least * header.points) + " bytes for them");
    }
    cloud.points.resize(header.points);
    if (header.data == "ascii") {
      read_ascii(file, header, columns, cloud.points);
    } else {
      if (least * header.points > left) bad_file(file.name, at_byte(file.size()), "the end of the file", "1 byte more");
      read_binary(file.data.data() + header.body, columns, cloud.points);
    }
  } else {
    bad_file(file.name, "DATA", in_quotes(header.data), "ascii, binary or binary_compressed");
  }
  return cloud;
}

}  // namespace tribin::io
