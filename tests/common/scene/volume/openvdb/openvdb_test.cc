// Our reader of OpenVDB files: files/, which OpenVDB 10.0.1 wrote, and files made to harm.
//
// Each ball of files/ has the values of smoke() around (20, 20, -20), five voxels that are off but not the
// background, and a cube of 128 voxels a side of one value, all at a quarter of their index.
#include "common/scene/volume/openvdb/openvdb.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

#include "common/base/error.h"
#include "common/scene/transform.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

std::string file(const std::string& name) {
  return std::string(LIGHTMILL_SOURCE_DIR) + "/tests/common/scene/volume/openvdb/files/" + name;
}

float smoke(int x, int y, int z) {
  const float r = std::sqrt(static_cast<float>(x * x + y * y + z * z));
  return r < 9 ? 0.125f + 0.125f * static_cast<float>((x & 7) + 2 * (y & 7) + 4 * (z & 7)) : 0;
}
float expected_at(int x, int y, int z) {
  if (x == 23 && y == 23 && z == -17) return 0.25f;
  if (x == 23 && y == 24 && z == -17) return 0.5f;
  if (x == 40 && y == 0 && z == -1) return 0.125f;
  if (x == 56 && y == 1 && z == -1) return 0;  // -1 in the file
  if (x == 57 && y == 1 && z == -1) return 0.5f;
  if (x >= 128 && x < 256 && y >= 0 && y < 128 && z >= -128 && z < 0) return 0.75f;
  return smoke(x - 20, y - 20, z + 20);
}

/// The value at an index of the grid.
float value_at(const VolumeGrid& g, int x, int y, int z) {
  const auto cell = [](int i, double lo) { return static_cast<int>(i - (lo + 0.5)); };
  const int c[3] = {cell(x, g.field.lo.x), cell(y, g.field.lo.y), cell(z, g.field.lo.z)};
  if (c[0] < 0 || c[1] < 0 || c[2] < 0 || c[0] >= g.field.nx || c[1] >= g.field.ny || c[2] >= g.field.nz)
    return 0;
  return g.field.at(c[0], c[1], c[2]);
}

void expect_ball(const VolumeGrid& g) {
  for (int x = 0; x < 64; ++x) {
    for (int y = -1; y < 40; ++y) {
      for (int z = -40; z < 8; ++z)
        ASSERT_EQ(value_at(g, x, y, z), expected_at(x, y, z)) << x << " " << y << " " << z;
    }
  }
  for (const int x : {127, 128, 200, 255, 256}) {
    for (const int y : {-1, 0, 127, 128})
      EXPECT_EQ(value_at(g, x, y, -1), expected_at(x, y, -1)) << x << " " << y;
  }
  // The box of what is on.
  EXPECT_EQ(g.lo.x, 12);
  EXPECT_EQ(g.lo.y, 0);
  EXPECT_EQ(g.lo.z, -128);
  EXPECT_EQ(g.hi.x, 256);
  EXPECT_EQ(g.hi.y, 128);
  EXPECT_EQ(g.hi.z, 0);
  EXPECT_TRUE(g.odd_values);
}

TEST(OpenVdb, ValuesAreThoseOfTheFileHoweverTheyArePacked) {
  for (const char* name : {"mask.vdb", "blosc_mask.vdb", "half_mask.vdb", "half_blosc_mask.vdb",
                           "double_mask.vdb", "double_half_blosc.vdb"}) {
    SCOPED_TRACE(name);
    const VolumeGrid g = read_openvdb(file(name), "density");
    expect_ball(g);
    EXPECT_EQ(g.index_to_world.m[0][0], 0.25);
  }
  const VolumeGrid plain = read_openvdb(file("plain.vdb"), "density");
  EXPECT_EQ(value_at(plain, 3, 4, 5), 1);
  EXPECT_EQ(value_at(plain, 3, 5, 5), 0);
  EXPECT_FALSE(plain.odd_values);
}

TEST(OpenVdb, TransformsAreThoseOfTheFile) {
  // Where the library puts index (3, 4, 5).
  const std::pair<const char*, Vec3d> places[] = {
      {"scaled", {0.75, 1, 1.25}},           {"moved", {1.75, 3, 4.25}}, {"stretched", {3, 8, 2.5}},
      {"stretched and moved", {0, 10, 5.5}}, {"turned", {3.5, 2, -1.5}}, {"translated", {4, 6, 8}}};
  for (const auto& [name, expected] : places) {
    const VolumeGrid g = read_openvdb(file("transforms.vdb"), name);
    EXPECT_EQ(value_at(g, 3, 4, 5), 1) << name;
    const Vec3d p = transform_point(g.index_to_world, {3, 4, 5});
    EXPECT_NEAR(p.x, expected.x, 1e-12) << name;
    EXPECT_NEAR(p.y, expected.y, 1e-12) << name;
    EXPECT_NEAR(p.z, expected.z, 1e-12) << name;
  }
  EXPECT_EQ(list_openvdb(file("transforms.vdb")).back().why_not, "is tapered, which is not supported");
  EXPECT_THROW(read_openvdb(file("transforms.vdb"), "tapered"), Error);
}

TEST(OpenVdb, AFileSaysWhichGridsItHas) {
  const std::vector<VolumeGridEntry> grids = list_openvdb(file("several.vdb"));
  ASSERT_EQ(grids.size(), 8u);
  const auto why = [&](const std::string& name) {
    return std::ranges::find(grids, name, &VolumeGridEntry::name)->why_not;
  };
  EXPECT_EQ(why("density"), "");
  EXPECT_EQ(why("surface"), "is a level set");
  EXPECT_EQ(why("color"), "has values that are no floats");
  for (const char* name : {"surface", "color", "empty", "heat"})
    EXPECT_THROW(read_openvdb(file("several.vdb"), name), Error) << name;
  expect_ball(read_openvdb(file("several.vdb"), "density"));  // the first of two
  // The same tree elsewhere.
  const VolumeGrid moved = read_openvdb(file("several.vdb"), "moved");
  expect_ball(moved);
  EXPECT_EQ(moved.index_to_world.m[0][0], 3);
}

TEST(OpenVdb, BeyondTheGridIsNothingWhateverItsBackground) {
  const VolumeGrid one = read_openvdb(file("several.vdb"), "on a background");
  EXPECT_EQ(value_at(one, 3, 4, 5), 1);
  EXPECT_EQ(value_at(one, 3, 4, 6), 0);
  EXPECT_TRUE(one.odd_values);
  // Off voxels at the background and at minus it, which a bit each tells apart.
  const VolumeGrid both = read_openvdb(file("several.vdb"), "both backgrounds");
  EXPECT_EQ(value_at(both, 0, 1, 0), 3);
  for (int x = 0; x < 8; ++x) EXPECT_EQ(value_at(both, x, 0, 0), 0) << x;
}

TEST(OpenVdb, AStreamHasNoPlacesAndIsRefused) {
  try {
    list_openvdb(file("stream.vdb"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("as a stream"), std::string::npos) << error.what();
  }
}

std::vector<char> bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write(const std::string& path, const std::vector<char>& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// Writes a grid of one leaf at the origin, packed by zip: Debian's library is built without it.
std::vector<char> zipped_leaf() {
  std::vector<char> out;
  const auto bytes = [&](const auto& x) {
    const char* const p = reinterpret_cast<const char*>(&x);
    out.insert(out.end(), p, p + sizeof x);
  };
  const auto text = [&](const std::string& s) {
    bytes(static_cast<uint32_t>(s.size()));
    out.insert(out.end(), s.begin(), s.end());
  };
  const auto values = [&](size_t count, float value) {
    bytes(uint8_t{6});  // all of them
    const std::vector<float> plain(count, value);
    uLongf size = compressBound(count * sizeof(float));
    std::vector<Bytef> packed(size);
    compress(packed.data(), &size, reinterpret_cast<const Bytef*>(plain.data()), count * sizeof(float));
    bytes(static_cast<int64_t>(size));
    out.insert(out.end(), packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size));
  };
  const auto mask = [&](size_t words, uint64_t first) {
    for (size_t i = 0; i < words; ++i) bytes(i == 0 ? first : uint64_t{0});
  };
  bytes(uint64_t{0x56444220}), bytes(uint32_t{224}), bytes(uint64_t{10}), bytes(uint8_t{1});
  out.insert(out.end(), 36, '0');
  bytes(uint32_t{0}), bytes(int32_t{1});
  text("density"), text("Tree_float_5_4_3"), text("");
  const size_t places = out.size();
  bytes(int64_t{0}), bytes(int64_t{0}), bytes(int64_t{0});
  int64_t grid[3] = {static_cast<int64_t>(out.size())};
  bytes(uint32_t{1}), bytes(uint32_t{0}), text("TranslationMap");
  bytes(1.0), bytes(2.0), bytes(3.0);
  bytes(uint32_t{1}), bytes(0.0f), bytes(uint32_t{0}), bytes(uint32_t{1});
  bytes(int32_t{0}), bytes(int32_t{0}), bytes(int32_t{0});
  mask(512, 1), mask(512, 0), values(32768, 0);
  mask(64, 1), mask(64, 0), values(4096, 0);
  mask(8, ~uint64_t{0});
  grid[1] = static_cast<int64_t>(out.size());
  mask(8, ~uint64_t{0}), values(512, 0.5f);
  grid[2] = static_cast<int64_t>(out.size());
  std::copy_n(reinterpret_cast<const char*>(grid), sizeof grid,
              out.begin() + static_cast<std::ptrdiff_t>(places));
  return out;
}

TEST(OpenVdb, ZippedValuesAreRead) {
  const TemporaryFolder folder;
  write(folder.file("a.vdb"), zipped_leaf());
  const VolumeGrid g = read_openvdb(folder.file("a.vdb"), "density");
  EXPECT_EQ(value_at(g, 7, 7, 7), 0.5f);
  EXPECT_EQ(g.index_to_world.m[2][3], 3);
}

// Whatever a file says, it is read or refused, without memory that its size does not pay for.
TEST(OpenVdb, DamageIsRefusedOrHarmless) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.vdb");
  const auto read_all = [&] {
    for (const VolumeGridEntry& e : list_openvdb(path)) {
      if (e.why_not.empty()) read_openvdb(path, e.name);
    }
  };
  for (const std::vector<char>& good :
       {zipped_leaf(), bytes_of(file("blosc_mask.vdb")), bytes_of(file("half_mask.vdb"))}) {
    write(path, good);
    ASSERT_NO_THROW(read_all());
    for (size_t size = 0; size < good.size(); size = size < 1000 ? size + 13 : size + good.size() / 20) {
      write(path, {good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)});
      EXPECT_THROW(read_all(), Error) << size;
    }
    // Counts and places are in the heads and where masks are not zero.
    std::vector<size_t> places;
    for (size_t i = 0; i < good.size(); ++i) {
      if (i < 1200 || good[i] != 0) places.push_back(i);
    }
    std::mt19937 random(7);
    for (int i = 0; i < 300; ++i) {
      std::vector<char> bad = good;
      for (int j = 0; j < 3; ++j) bad[places[random() % places.size()]] = static_cast<char>(random());
      write(path, bad);
      try {
        read_all();
      } catch (const Error&) {  // NOLINT(bugprone-empty-catch): refused
      }
    }
  }
}

}  // namespace
}  // namespace lightmill::test
