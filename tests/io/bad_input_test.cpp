#include <gtest/gtest.h>
#include <sys/resource.h>

#include <fstream>
#include <iterator>
#include <random>

#include "support/parse_any.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/write.hpp"

namespace tribin {
namespace {

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

struct GoodFile {
  std::string family, name, bytes;
};

/// A good file of each family, made by the writers or by hand.
std::vector<GoodFile> good_files() {
  const test::TemporaryFolder folder;
  Scan scan;
  scan.camera = {24, 16, 40, 40, 12, 8};
  scan.z_mm = Image<float>(24, 16);
  for (int v = 0; v < 16; ++v) {
    for (int u = 0; u < 24; ++u) scan.z_mm(u, v) = u == 5 ? NAN : 500.f + u * v;
  }
  Mesh mesh;
  for (int i = 0; i < 4; ++i) mesh.vertices.emplace_back(10.f * (i == 1), 10.f * (i == 2), 10.f * (i == 3));
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::vector<GoodFile> files;
  for (const char* name : {"a.pcd", "a.ply", "a.xyz", "a.png"}) {
    write_scan(folder.path() / name, scan);
    files.push_back({std::string(name).substr(2), name, bytes_of(folder.path() / name)});
  }
  for (const auto& [family, name] :
       {std::pair{"stl", "m.stl"}, {"obj", "m.obj"}, {"ply_mesh", "m.ply"}, {"dxf", "m.dxf"}}) {
    write_mesh(folder.path() / name, mesh);
    files.push_back({family, name, bytes_of(folder.path() / name)});
  }
  files.push_back(
      {"stl", "text.stl",
       "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
       "endsolid a\n"});
  files.push_back(
      {"ply_mesh", "text.ply",
       "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
       "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"});
  files.push_back(
      {"pcd", "text.pcd",
       "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
       "POINTS 3\nDATA ascii\n0 0 500\n1 0 500\nnan nan nan\n"});
  std::string packed =
      "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA "
      "binary_compressed\n";
  packed += std::string("\x0d\0\0\0\x30\0\0\0", 8);
  // A zero, 31 more by reference; 2.0, three more by reference: x, y = 0 and z = 2 of four points, field by field.
  packed += std::string("\x00\x00\xe0\x16\x00", 5) + std::string("\x03\x00\x00\x00\x40\xe0\x03\x03", 8);
  files.push_back({"pcd", "packed.pcd", packed});
  std::string npy = "{'descr': '<f4', 'fortran_order': False, 'shape': (6, 8), }";
  npy.resize(117, ' ');
  npy = std::string("\x93NUMPY\x01\x00\x76\x00", 10) + npy + "\n";
  for (int i = 0; i < 48; ++i) {
    const float z = 600.f + i;
    npy.append(reinterpret_cast<const char*>(&z), 4);
  }
  files.push_back({"npy", "a.npy", npy});
  files.push_back({"dxf", "polyface.dxf",
                   "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nB\n10\n1\n20\n0\n30\n0\n0\nPOLYLINE\n66\n1\n70\n64\n71\n3\n72\n"
                   "1\n0\nVERTEX\n10\n0\n20\n0\n30\n0\n70\n192\n"
                   "0\nVERTEX\n10\n1\n20\n0\n30\n0\n70\n192\n0\nVERTEX\n10\n0\n20\n1\n30\n0\n70\n192\n0\nVERTEX\n10\n0"
                   "\n20\n0\n30\n0\n70\n128\n71\n1\n72\n-2\n73\n3\n0\nSEQEND\n"
                   "0\nENDBLK\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nINSERT\n2\nb\n10\n5\n20\n0\n30\n0\n41\n2\n70\n2\n"
                   "44\n10\n0\nENDSEC\n0\nEOF\n"});
  return files;
}

/// True when the bytes are read or refused by an error with a message; anything else fails the test.
bool read_or_refused(const GoodFile& file, const std::string& bytes, std::string& message) {
  try {
    test::parse_any(file.family, {file.name, bytes});
    message.clear();
    return true;
  } catch (const Error& error) {
    message = error.what();
    return error.code() == ErrorCode::bad_input || error.code() == ErrorCode::too_little_data;
  } catch (const std::exception& error) {
    message = std::string("not a tribin::Error: ") + error.what();
    return false;
  }
}

/// Holds the process to 1 GB more of address space than it has; sanitizers need the space, so there it does nothing.
class MemoryLimit {
 public:
  MemoryLimit() {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    std::ifstream statm("/proc/self/statm");
    std::size_t pages = 0;
    statm >> pages;
    ::getrlimit(RLIMIT_AS, &before_);
    rlimit limit = before_;
    limit.rlim_cur = pages * 4096 + (std::size_t{1} << 30);
    ::setrlimit(RLIMIT_AS, &limit);
    set_ = true;
#endif
  }
  ~MemoryLimit() {
    if (set_) ::setrlimit(RLIMIT_AS, &before_);
  }

 private:
  rlimit before_{};
  bool set_ = false;
};

TEST(BadInput, GoodFilesAreGood) {
  for (const GoodFile& file : good_files()) {
    SCOPED_TRACE(file.name);
    std::string message;
    EXPECT_TRUE(read_or_refused(file, file.bytes, message)) << message;
    EXPECT_EQ(message, "");
  }
}

TEST(BadInput, FilesCutAnywhereNeverCrash) {
  const MemoryLimit limit;
  for (const GoodFile& file : good_files()) {
    const std::size_t step = std::max<std::size_t>(1, file.bytes.size() / 400);
    for (std::size_t length = 1; length < file.bytes.size(); length += step) {
      std::string message;
      EXPECT_TRUE(read_or_refused(file, file.bytes.substr(0, length), message))
          << file.name << " " << length << " " << message;
    }
  }
}

TEST(BadInput, SpoiltBytesNeverCrash) {
  const MemoryLimit limit;
  for (const GoodFile& file : good_files()) {
    for (unsigned seed = 1; seed <= 400; ++seed) {
      std::mt19937 random(seed);
      std::string bytes = file.bytes;
      const std::size_t reach =
          seed % 2 ? bytes.size() : std::min<std::size_t>(bytes.size(), 300);  // headers decide most
      for (unsigned i = 0; i <= seed % 5; ++i) {
        char& c = bytes[random() % reach];
        const unsigned what = random() % 3;
        if (what == 0) c = static_cast<char>(c ^ (1 << random() % 8));
        if (what == 1) c = static_cast<char>(random());
        if (what == 2) c = "0123456789-.e \n"[random() % 15];
      }
      if (seed % 7 == 0) bytes.erase(random() % bytes.size(), random() % 20);
      if (seed % 11 == 0) bytes.insert(random() % bytes.size(), bytes.substr(random() % bytes.size(), 30));
      std::string message;
      EXPECT_TRUE(read_or_refused(file, bytes, message)) << file.name << " seed " << seed << ": " << message;
    }
  }
}

struct BadFile {
  const char* name;
  std::string bytes;
  std::vector<std::string> said;  ///< what the message has to hold
};

TEST(BadInput, MessagesSayFilePlaceSeenAndWanted) {
  const MemoryLimit limit;
  const std::string pcd = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";
  const std::string ply = "ply\nformat ascii 1.0\n";
  const std::string ply_xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::vector<BadFile> table = {
      {"a.pcd",
       pcd + "WIDTH 4000000000\nHEIGHT 4000000000\nPOINTS 16\nDATA binary\n",
       {"a.pcd", "POINTS 16", "WIDTH x HEIGHT"}},
      {"b.pcd", pcd + "WIDTH 90000000\nHEIGHT 1\nPOINTS 90000000\nDATA binary\nabc", {"90000000 points in 3 bytes"}},
      {"c.pcd", pcd + "WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n1 2 3\n444 555\n", {"line 10", "2 values", "3"}},
      {"d.pcd", pcd + "WIDTH -5\nHEIGHT 1\nPOINTS 2\nDATA ascii\n1 2 3\n", {"line 5", "\"-5\"", "whole number"}},
      {"e.pcd",
       pcd + "WIDTH 1\nHEIGHT 1\nVIEWPOINT 0 0 0 0 0 0 0\nPOINTS 1\nDATA ascii\n1 2 3\n",
       {"line 7", "quaternion"}},
      {"f.pcd", "hello\n", {"f.pcd", "line 1", "hello", "PCD header"}},
      {"a.ply",
       ply + "element vertex 2000000000\n" + ply_xyz + "end_header\n1 2 3\n",
       {"vertex", "2000000000", "6 bytes"}},
      {"b.ply", ply + "element vertex 2\n" + ply_xyz + "end_header\n1 2 3\n1 x 3\n", {"line 9", "\"x\"", "number"}},
      {"c.ply", ply + "element vertex -2\n" + ply_xyz + "end_header\n", {"line 3", "count"}},
      {"a.png", "this is text", {"a.png", "byte 0", "PNG"}},
      {"a.npy", "this is text", {"a.npy", "byte 0", "NPY"}},
      {"a.xyz", "1 2 3\n4 5\n", {"line 2", "3 numbers"}},
      {"b.xyz", "1 2 3\nfoo bar baz\n", {"line 2", "foo bar"}},
      {"a.stl",
       std::string(80, 'x') + std::string("\xff\xff\xff\x7f", 4) + "abc",
       {"byte 80", "2147483647 facets in 87 bytes"}},
      {"b.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 nan 0\n", {"line 5", "no number"}},
      {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", {"line 4", "vertex 4", "1..3"}},
      {"b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -9\n", {"line 4", "vertex -9"}},
      {"a.dxf", "0\nSECTION\n2\nENTITIES\n0\n3DFACE\n10\n0\n", {"a.dxf", "end of the file", "EOF"}},
      {"b.dxf", "0\nSECTION\n2\nENTITIES\n0\n3DSOLID\n0\nENDSEC\n0\nEOF\n", {"3DSOLID", "not supported", "STEP"}},
      {"c.dxf",
       "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nA\n0\nINSERT\n2\nA\n0\nENDBLK\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nINSER"
       "T\n2\nA\n0\nENDSEC\n0\nEOF\n",
       {"block", "\"A\"", "holds itself"}},
      {"d.dxf", "AutoCAD Binary DXF\r\n", {"binary DXF", "ASCII"}},
      {"a.abc", "text", {"a.abc", "\".abc\"", ".stl"}},
      {"g.pcd", "", {"g.pcd", "empty"}},
  };
  const test::TemporaryFolder folder;
  for (const BadFile& file : table) {
    SCOPED_TRACE(file.name);
    const auto path = folder.write(file.name, file.bytes);
    const std::string extension = path.extension();
    try {
      if (extension == ".stl" || extension == ".obj" || extension == ".dxf" || extension == ".abc")
        read_cad(path);
      else
        read_scan_or_points(path);
      ADD_FAILURE() << "was read";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_input);
      for (const std::string& part : file.said) {
        EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what() << " lacks: " << part;
      }
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "one sentence";
    }
  }
  EXPECT_THROW(read_cad(folder.path() / "none.stl"), Error);
  std::filesystem::create_directory(folder.path() / "folder.ply");
  EXPECT_THROW(read_scan(folder.path() / "folder.ply"), Error);
}

TEST(BadInput, BlocksThatMultiplyAreRefusedBeforeTheyAreLaidOut) {
  std::string text =
      "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nB0\n0\n3DFACE\n10\n0\n20\n0\n30\n0\n11\n1\n21\n0\n31\n0\n12\n0\n22\n1\n32\n0"
      "\n0\nENDBLK\n";
  for (int i = 1; i < 40; ++i) {
    const std::string inner = "0\nINSERT\n2\nB" + std::to_string(i - 1) + "\n";
    text += "0\nBLOCK\n2\nB" + std::to_string(i) + "\n" + inner + inner + "0\nENDBLK\n";
  }
  text += "0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nINSERT\n2\nB39\n0\nENDSEC\n0\nEOF\n";
  std::string message;
  EXPECT_TRUE(read_or_refused({"dxf", "many.dxf", ""}, text, message));
  EXPECT_NE(message.find("triangles by nested INSERTs"), std::string::npos) << message;
}

TEST(Writers, LeaveNothingBehindWhereTheyCannotWrite) {
  const test::TemporaryFolder folder;
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_THROW(write_mesh(folder.path() / "none" / "a.stl", mesh), Error);
  std::filesystem::create_directory(folder.path() / "b.stl");
  EXPECT_THROW(write_mesh(folder.path() / "b.stl", mesh), Error);
  EXPECT_THROW(write_mesh(folder.path() / "a.step", mesh), Error);
  int files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::recursive_directory_iterator(folder.path())) ++files;
  EXPECT_EQ(files, 1);  // the folder b.stl
}

}  // namespace
}  // namespace tribin
