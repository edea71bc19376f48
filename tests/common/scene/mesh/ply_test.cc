#include <zlib.h>

#include <bit>
#include <cstring>
#include <limits>

#include "common/base/error.h"
#include "common/scene/mesh/ply_reader.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

enum class Encoding { kAscii, kLittle, kBig };

/// Writes values in one of the encodings.
class PlyWriter {
 public:
  explicit PlyWriter(Encoding encoding) : encoding_(encoding) {}
  template <class T>
  void put(T value) {
    if (encoding_ == Encoding::kAscii) {
      char text[64];
      snprintf(text, sizeof text, "%.9g ", static_cast<double>(value));
      body += text;
      return;
    }
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &value, sizeof(T));
    if (encoding_ == Encoding::kBig) std::reverse(bytes.begin(), bytes.end());
    body.append(bytes.data(), bytes.size());
  }
  void end_row() {
    if (encoding_ == Encoding::kAscii) body += '\n';
  }
  std::string format() const {
    return encoding_ == Encoding::kAscii    ? "ascii"
           : encoding_ == Encoding::kLittle ? "binary_little_endian"
                                            : "binary_big_endian";
  }
  std::string body;

 private:
  Encoding encoding_;
};

constexpr float kQuad[4][3] = {{0, 0, 0}, {1, 0, 0.25f}, {1, 1, 0.1f}, {0, 1, 0}};

/// A mesh of one quad, one triangle and one pentagon-like fan over the quad's vertices, with everything a
/// file may hold: normals, uv under various names, other properties, other elements.
std::string rich_ply(Encoding encoding, const std::string& u, const std::string& v) {
  PlyWriter w(encoding);
  for (int i = 0; i < 2; ++i) w.put<int16_t>(7);  // element "extra"
  w.end_row();
  for (const auto& p : kQuad) {
    w.put<double>(p[0]);
    w.put<uint8_t>(200);  // red
    w.put<float>(p[1]);
    w.put<float>(p[2]);
    for (float n : {0.f, 0.f, 1.f}) w.put<float>(n);
    w.put<float>(p[0] * 0.5f);
    w.put<float>(p[1] * 0.5f);
    w.end_row();
  }
  const std::vector<std::vector<uint16_t>> faces = {{0, 1, 2, 3}, {2, 1, 0}, {0, 1, 2, 3, 1}};
  for (const auto& face : faces) {
    w.put<int32_t>(static_cast<int32_t>(face.size()));
    for (uint16_t index : face) w.put<uint16_t>(index);
    w.put<float>(0.5f);  // quality
    w.end_row();
  }
  return "ply\nformat " + w.format() +
         " 1.0\ncomment made by a test\nobj_info nothing\nelement extra 1\nproperty short a\n"
         "property short b\nelement vertex 4\nproperty double x\nproperty uchar red\nproperty float "
         "y\nproperty float z\n"
         "property float nx\nproperty float ny\nproperty float nz\nproperty float " +
         u + "\nproperty float " + v +
         "\nelement face 3\nproperty list int ushort vertex_index\nproperty float quality\nend_header\n" +
         w.body;
}

void expect_rich(const TriangleMesh& m) {
  ASSERT_EQ(m.positions.size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(m.positions[i].x, kQuad[i][0]);
    EXPECT_EQ(m.positions[i].y, kQuad[i][1]);
    EXPECT_EQ(m.positions[i].z, kQuad[i][2]);
    EXPECT_EQ(m.normals.at(i).z, 1);
    EXPECT_EQ(m.uvs.at(i).x, kQuad[i][0] * 0.5f);
    EXPECT_EQ(m.uvs.at(i).y, kQuad[i][1] * 0.5f);
  }
  EXPECT_EQ(m.triangles, (std::vector<std::array<uint32_t, 3>>{
                             {0, 1, 2}, {0, 2, 3}, {2, 1, 0}, {0, 1, 2}, {0, 2, 3}, {0, 3, 1}}));
}

/// The common layout: float positions, triangles as uchar + int.
std::string plain_ply(Encoding encoding, const std::vector<std::array<int32_t, 3>>& faces, float last_z = 0) {
  PlyWriter w(encoding);
  for (size_t i = 0; i < 4; ++i) {
    w.put<float>(kQuad[i][0]);
    w.put<float>(kQuad[i][1]);
    w.put<float>(i == 3 ? last_z : kQuad[i][2]);
    w.end_row();
  }
  for (const auto& f : faces) {
    w.put<uint8_t>(3);
    for (int32_t index : f) w.put<int32_t>(index);
    w.end_row();
  }
  return "ply\nformat " + w.format() +
         " 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         std::to_string(faces.size()) + "\nproperty list uchar int vertex_indices\nend_header\n" + w.body;
}

std::string gzipped(const std::string& data) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&stream, data.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data()));
  stream.avail_in = static_cast<uInt>(data.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

class PlyEncodings : public testing::TestWithParam<Encoding> {};
INSTANTIATE_TEST_SUITE_P(All, PlyEncodings,
                         testing::Values(Encoding::kAscii, Encoding::kLittle, Encoding::kBig));

TEST_P(PlyEncodings, RichFile) {
  expect_rich(parse_ply(rich_ply(GetParam(), "u", "v")));
  expect_rich(parse_ply(rich_ply(GetParam(), "s", "t")));
  expect_rich(parse_ply(rich_ply(GetParam(), "texture_u", "texture_v")));
}

TEST_P(PlyEncodings, PlainFile) {
  const TriangleMesh m = parse_ply(plain_ply(GetParam(), {{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(m.triangles.size(), 2u);
  EXPECT_EQ(m.positions[1].z, 0.25f);
  EXPECT_TRUE(m.normals.empty());
  EXPECT_TRUE(m.uvs.empty());
}

TEST_P(PlyEncodings, EveryTruncationIsAnError) {
  for (const std::string& whole :
       {plain_ply(GetParam(), {{0, 1, 2}, {0, 2, 3}}), rich_ply(GetParam(), "u", "v")}) {
    // Text may lose its last blank and newline and still be whole; and a digit of the unread last value.
    const size_t slack = GetParam() == Encoding::kAscii ? 4 : 0;
    for (size_t n = 0; n + 1 + slack <= whole.size(); ++n)
      EXPECT_THROW(parse_ply(whole.substr(0, n)), Error) << n;
  }
}

TEST_P(PlyEncodings, BadIndicesAndVertices) {
  EXPECT_THROW(parse_ply(plain_ply(GetParam(), {{0, 1, 4}})), Error);
  EXPECT_THROW(parse_ply(plain_ply(GetParam(), {{0, 1, -1}})), Error);
  EXPECT_THROW(parse_ply(plain_ply(GetParam(), {{0, 1, 2}}, std::numeric_limits<float>::quiet_NaN())), Error);
  EXPECT_THROW(parse_ply(plain_ply(GetParam(), {{0, 1, 2}}, std::numeric_limits<float>::infinity())), Error);
  EXPECT_TRUE(parse_ply(plain_ply(GetParam(), {})).triangles.empty()) << "it draws nothing";
}

TEST(Ply, AbsurdCountsAreRefusedWithoutAllocating) {
  for (const char* count : {"4000000000", "18446744073709551615", "99999999999999999999", "-1", "x"}) {
    for (const char* element : {"vertex 4", "face 2"}) {
      std::string text = plain_ply(Encoding::kLittle, {{0, 1, 2}, {0, 2, 3}});
      const size_t at = text.find(element);
      text.replace(at + std::strlen(element) - 1, 1, count);
      EXPECT_THROW(parse_ply(text), Error) << element << " " << count;
    }
  }
}

TEST(Ply, BadHeaders) {
  const std::string vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string bad[] = {
      "",
      "ply",
      "plx\n",
      "ply\nformat ascii 1.0\n",
      "ply\nformat ascii 1.0\nend_header\n",
      "ply\nformat utf8 1.0\n" + vertex + "end_header\n",
      "ply\n" + vertex + "end_header\n",
      "ply\nformat ascii 1.0\nproperty float x\nend_header\n",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty quad x\nend_header\n",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nend_header\n0 0 1 0 0 "
      "1\n",
      "ply\nformat ascii 1.0\nelement nothing 5\n" + vertex + "end_header\n0 0 0 1 0 0 0 1 0\n",
      "ply\nformat ascii 1.0\n" + vertex +
          "element face 1\nproperty list float int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0\n3 0 1 2\n",
      "ply\nformat ascii 1.0\n" + vertex +
          "element face 1\nproperty list uchar float vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0\n3 0 1 "
          "2\n",
      "ply\nformat ascii 1.0\n" + vertex +
          "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0\n2 0 1\n",
      "ply\nformat ascii 1.0\n" + vertex +
          "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 z\n3 0 1 2\n",
      "ply\nformat ascii 1.0\n" + vertex +
          "element face 1\nproperty list int int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0\n1000000000 0 "
          "1 2\n",
  };
  for (const std::string& text : bad) EXPECT_THROW(parse_ply(text), Error) << text;
}

class PlyFiles : public SceneTest {};

TEST_F(PlyFiles, GzipByItsMagicNumber) {
  folder_.write("mesh.ply.gz", gzipped(plain_ply(Encoding::kLittle, {{0, 1, 2}})));
  folder_.write("named.ply", gzipped(rich_ply(Encoding::kAscii, "u", "v")));
  EXPECT_EQ(read_ply(folder_.path() + "/mesh.ply.gz").triangles.size(), 1u);
  expect_rich(read_ply(folder_.path() + "/named.ply"));
}

TEST_F(PlyFiles, DamagedGzipIsOneLine) {
  const std::string packed = gzipped(plain_ply(Encoding::kLittle, {{0, 1, 2}}));
  folder_.write("cut.ply.gz", packed.substr(0, packed.size() / 2));
  folder_.write("bad.ply.gz", packed.substr(0, 12) + "garbage that is no deflate stream");
  for (const char* name : {"cut.ply.gz", "bad.ply.gz"}) {
    EXPECT_TRUE(has_error(load_world("Shape \"plymesh\" \"string filename\" \"" + std::string(name) + "\""),
                          "gzip data"))
        << name;
  }
}

TEST_F(PlyFiles, ErrorsNameTheFileAndTheLine) {
  folder_.write("bad.ply", plain_ply(Encoding::kBig, {{0, 1, 9}}));
  EXPECT_TRUE(
      has_error(load_world("Shape \"plymesh\"\n  \"string filename\" \"bad.ply\""),
                "scene.pbrt:3:3: the mesh \"bad.ply\" face 0 refers to a vertex that does not exist"));
}

TEST_F(PlyFiles, AFileUsedTwiceIsReadOnceAndListedOnce) {
  folder_.write("m.ply", plain_ply(Encoding::kLittle, {{0, 1, 2}}));
  const SceneDescription s = clean_world(
      "Shape \"plymesh\" \"string filename\" \"m.ply\" Shape \"plymesh\" \"string filename\" \"./m.ply\"");
  EXPECT_EQ(std::get<MeshShape>(s.shapes.at(0).kind).mesh, std::get<MeshShape>(s.shapes.at(1).kind).mesh);
  EXPECT_EQ(s.files.size(), 2u);
}

/// Two triangles whose vertices lie at `height`, with a second set of uvs and colours.
std::string tall_ply(float height) {
  PlyWriter w(Encoding::kAscii);
  for (const auto& p : kQuad) {
    for (const float x : {p[0], p[1], height, p[0] / 2, p[1] / 4, 0.25f, p[0], p[1], 0.5f}) w.put<float>(x);
    w.end_row();
  }
  w.body += "3 0 1 2\n3 0 2 3\n";
  std::string header = "ply\nformat ascii 1.0\nelement vertex 4\n";
  for (const char* name : {"x", "y", "z", "u2", "v2", "red", "green", "blue", "alpha"})
    header += "property float " + std::string(name) + "\n";
  return header + "element face 2\nproperty list uchar int vertex_indices\nend_header\n" + w.body;
}

TEST(Ply, SecondCoordinatesAndColours) {
  const TriangleMesh mesh = parse_ply(tall_ply(0));
  ASSERT_EQ(mesh.second_uvs.size(), 4u);
  EXPECT_EQ(mesh.second_uvs[2].x, 0.5f);
  EXPECT_EQ(mesh.second_uvs[2].y, 0.25f);
  EXPECT_TRUE(mesh.uvs.empty());
  ASSERT_EQ(mesh.colors.size(), 4u);
  EXPECT_EQ(mesh.colors[1], (std::array{0.25f, 1.0f, 0.0f, 0.5f}));
}

TEST_F(PlyFiles, LaterStepsBendAMesh) {
  folder_.write("now.ply", tall_ply(0));
  folder_.write("soon.ply", tall_ply(1));
  folder_.write("then.ply", tall_ply(3));
  folder_.write("other.ply", plain_ply(Encoding::kLittle, {{0, 1, 2}}));
  const auto shape = [](const std::string& later) {
    return "Shape \"plymesh\" \"string filename\" \"now.ply\" \"string later\" [" + later + "]";
  };
  const SceneDescription s =
      clean_world(shape("\"soon.ply\" \"then.ply\"") + " Shape \"plymesh\" \"string filename\" \"now.ply\"");
  const TriangleMesh& mesh = *std::get<MeshShape>(s.shapes.at(0).kind).mesh;
  ASSERT_EQ(mesh.later.size(), 2u);
  EXPECT_EQ(mesh.later[1].positions[0].z, 3);
  EXPECT_TRUE(std::get<MeshShape>(s.shapes.at(1).kind).mesh->later.empty());
  EXPECT_EQ(s.files.size(), 4u);
  EXPECT_TRUE(mentions(load_world(shape("\"soon.ply\" \"then.ply\" \"then.ply\"")), "1, 2, 4, ... files"));
  EXPECT_TRUE(has_error(load_world(shape("\"none.ply\"")), "there is no file \"none.ply\""));
}

}  // namespace
}  // namespace lightmill
