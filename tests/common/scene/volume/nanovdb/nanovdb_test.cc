// Our reader of NanoVDB files against the library's own writer and accessors, and files made to harm.
#include "common/scene/volume/nanovdb/nanovdb.h"

#include <gtest/gtest.h>

// The library's headers are not ours to mend.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include <nanovdb/util/GridBuilder.h>
#include <nanovdb/util/IO.h>
#pragma GCC diagnostic pop

#include <cmath>
#include <fstream>
#include <random>

#include "common/base/error.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

float smoke(const nanovdb::Coord& p) {
  const float r = std::sqrt(static_cast<float>(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]));
  return r < 40 ? 1 - r / 40 + 0.01f * static_cast<float>((p[0] & 7) + 2 * (p[1] & 7) + 4 * (p[2] & 7)) : 0;
}

template <class Build>
nanovdb::GridHandle<> ball(const std::string& name, nanovdb::GridClass kind = nanovdb::GridClass::FogVolume) {
  nanovdb::GridBuilder<float, Build> builder(0.0f, kind);
  auto set = builder.getAccessor();
  for (int x = -40; x <= 40; ++x) {
    for (int y = -40; y <= 40; ++y) {
      for (int z = -40; z <= 40; ++z) {
        const nanovdb::Coord p(x, y, z);
        if (smoke(p) > 0) set.setValue(p, smoke(p));
      }
    }
  }
  return builder.getHandle(0.25, nanovdb::Vec3d(1, 2, 3), name);
}

/// The value at an index of the grid.
float value_at(const VolumeGrid& g, int x, int y, int z) {
  const auto cell = [](int i, double lo) { return static_cast<int>(i - (lo + 0.5)); };
  const int c[3] = {cell(x, g.field.lo.x), cell(y, g.field.lo.y), cell(z, g.field.lo.z)};
  if (c[0] < 0 || c[1] < 0 || c[2] < 0 || c[0] >= g.field.nx || c[1] >= g.field.ny || c[2] >= g.field.nz)
    return 0;
  return g.field.at(c[0], c[1], c[2]);
}

TEST(NanoVdb, ValuesAreTheLibrarysOwn) {
  const TemporaryFolder folder;
  const std::string path = folder.file("ball.nvdb");
  const auto expect_same = [&](const auto& handle, auto* grid, nanovdb::io::Codec codec) {
    nanovdb::io::writeGrid(path, handle, codec);
    const VolumeGrid read = read_nanovdb(path, "density");
    auto accessor = grid->getAccessor();
    for (int x = -44; x <= 44; x += 3) {
      for (int y = -44; y <= 44; ++y) {
        for (int z = -44; z <= 44; ++z)
          ASSERT_EQ(value_at(read, x, y, z), std::max(0.0f, accessor.getValue(nanovdb::Coord(x, y, z))))
              << x << " " << y << " " << z;
      }
    }
    EXPECT_EQ(read.index_to_world.m[0][0], 0.25);
    EXPECT_EQ(read.index_to_world.m[1][3], 2);
    EXPECT_EQ(read.lo.x, -39);
    EXPECT_EQ(read.hi.z, 40);
  };
  for (const auto codec : {nanovdb::io::Codec::NONE, nanovdb::io::Codec::ZIP, nanovdb::io::Codec::BLOSC}) {
    const auto plain = ball<float>("density");
    expect_same(plain, plain.grid<float>(), codec);
  }
  const auto fp4 = ball<nanovdb::Fp4>("density");
  expect_same(fp4, fp4.grid<nanovdb::Fp4>(), nanovdb::io::Codec::NONE);
  const auto fp8 = ball<nanovdb::Fp8>("density");
  expect_same(fp8, fp8.grid<nanovdb::Fp8>(), nanovdb::io::Codec::NONE);
  const auto fp16 = ball<nanovdb::Fp16>("density");
  expect_same(fp16, fp16.grid<nanovdb::Fp16>(), nanovdb::io::Codec::ZIP);
  const auto fpn = ball<nanovdb::FpN>("density");
  expect_same(fpn, fpn.grid<nanovdb::FpN>(), nanovdb::io::Codec::NONE);
}

TEST(NanoVdb, TilesAreValuesOfManyVoxels) {
  const TemporaryFolder folder;
  nanovdb::GridBuilder<float> builder(0.0f, nanovdb::GridClass::FogVolume);
  const auto one = [](const nanovdb::Coord&) { return 0.5f; };
  builder(one, nanovdb::CoordBBox(nanovdb::Coord(0), nanovdb::Coord(255)));
  const auto handle = builder.getHandle(1.0, nanovdb::Vec3d(0), "density");
  ASSERT_GT(handle.grid<float>()->tree().activeTileCount(2) + handle.grid<float>()->tree().activeTileCount(1),
            0u);
  nanovdb::io::writeGrid(folder.file("cube.nvdb"), handle);
  const VolumeGrid read = read_nanovdb(folder.file("cube.nvdb"), "density");
  EXPECT_EQ(value_at(read, 0, 0, 0), 0.5f);
  EXPECT_EQ(value_at(read, 200, 131, 255), 0.5f);
  EXPECT_EQ(value_at(read, 256, 131, 255), 0);
  EXPECT_EQ(read.field.block_values->size(), 512u);  // of which all blocks are one
}

TEST(NanoVdb, AFileSaysWhichGridsItHas) {
  const TemporaryFolder folder;
  const std::string path = folder.file("several.nvdb");
  std::vector<nanovdb::GridHandle<>> handles;
  handles.push_back(ball<float>("density"));
  handles.push_back(ball<float>("surface", nanovdb::GridClass::LevelSet));
  nanovdb::io::writeGrids(path, handles);
  const std::vector<VolumeGridEntry> grids = list_nanovdb(path);
  ASSERT_EQ(grids.size(), 2u);
  EXPECT_EQ(grids[0].name, "density");
  EXPECT_EQ(grids[0].why_not, "");
  EXPECT_EQ(grids[1].why_not, "is a level set");
  EXPECT_THROW(read_nanovdb(path, "surface"), Error);
  EXPECT_THROW(read_nanovdb(path, "heat"), Error);
}

std::vector<char> bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write(const std::string& path, const std::vector<char>& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// Whatever a file says, it is read or refused: no offset leads out of it, and no loop is without end.
TEST(NanoVdb, DamageIsRefusedOrHarmless) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.nvdb");
  for (const auto codec : {nanovdb::io::Codec::NONE, nanovdb::io::Codec::BLOSC}) {
    nanovdb::GridBuilder<float> builder(0.0f, nanovdb::GridClass::FogVolume);
    builder.getAccessor().setValue(nanovdb::Coord(3, 4, 5), 1);
    nanovdb::io::writeGrid(path, builder.getHandle(1.0, nanovdb::Vec3d(0), "density"), codec);
    const std::vector<char> good = bytes_of(path);
    ASSERT_NO_THROW(read_nanovdb(path, "density"));
    for (size_t size = 0; size < good.size(); size = size < 1000 ? size + 13 : size + good.size() / 20) {
      write(path, {good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)});
      EXPECT_THROW(read_nanovdb(path, "density"), Error) << size;
    }
    // Offsets and counts are in the headers and where tables are not zero.
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
        read_nanovdb(path, "density");
      } catch (const Error&) {  // NOLINT(bugprone-empty-catch): refused
      }
    }
  }
}

}  // namespace
}  // namespace lightmill::test
