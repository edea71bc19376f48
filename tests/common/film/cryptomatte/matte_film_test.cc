// Cryptomatte's counts: merged in any order, ranked, written and read; and bytes that nobody wrote.
#include "common/film/cryptomatte/matte_film.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "common/base/error.h"
#include "common/film/film.h"
#include "common/film/packing.h"
#include "common/image/cryptomatte/cryptomatte_hash.h"
#include "tests/common/film/test_partials.h"

namespace lightmill {
namespace {

using testing::full_grid;

constexpr const char* kNames[] = {"Cube", "Sphere", "Kugel \"ä\"", "red", "green", "Root"};

/// Random counts of up to `most` keys a pixel, of those within the crop window.
MatteSums random_counts(const FilmGrid& grid, const CellRect& cells, uint64_t seed, int most = 4) {
  std::mt19937_64 rng(seed);
  MatteSums sums;
  sums.names.assign(std::begin(kNames), std::end(kNames));
  std::shuffle(sums.names.begin(), sums.names.end(), rng);
  const auto name = [&] { return static_cast<uint32_t>(rng() % std::size(kNames)); };
  for (int y = cells.y0; y < cells.y1; ++y) {
    for (int x = cells.x0; x < cells.x1; ++x) {
      const PixelRect inside = grid.pixels({x, y, x + 1, y + 1});
      MatteCell once;  // a count a pixel
      MatteCell& cell = sums.cells.emplace_back();
      for (int round = 0; round < most; ++round) {
        once = {};
        for (int i = 0; i < kCellPixels; ++i) {
          const int px = x * kCellSize + i % kCellSize, py = y * kCellSize + i / kCellSize;
          if (px >= inside.x0 && px < inside.x1 && py >= inside.y0 && py < inside.y1 && rng() % 2)
            once.counts.push_back({matte_key(name(), name(), name()), 1 + rng() % 3});
          once.ends.push_back(static_cast<uint32_t>(once.counts.size()));
        }
        add_counts(once, {}, &cell);
      }
    }
  }
  return canonical(sums);
}

std::string bytes_of(const MatteSums& sums) {
  ByteWriter out;
  encode_mattes(sums, &out);
  return out.bytes();
}

MatteSums decoded(std::string_view bytes, size_t cells, uint64_t most = ~uint64_t{0}) {
  ByteReader in(bytes, "test");
  MatteSums sums = decode_mattes(&in, cells, most);
  in.expect_end();
  return sums;
}

std::string bytes_of(const MatteFilm& film) {
  ByteWriter out;
  film.write(&out);
  return out.bytes();
}

constexpr CellRect kCells{0, 0, 3, 2};
FilmGrid grid_of() { return {90, 60, {5, 3, 90, 60}}; }

TEST(MatteFilm, TheOrderOfPartialsLeavesNoTrace) {
  const FilmGrid grid = grid_of();
  std::vector<std::pair<CellRect, MatteSums>> partials;
  uint64_t seed = 0;
  for (const CellRect& cells : {kCells, CellRect{0, 0, 1, 2}, CellRect{1, 0, 3, 1}, CellRect{2, 1, 3, 2}})
    partials.emplace_back(cells, random_counts(grid, cells, ++seed));
  std::string first;
  std::vector<float> ranks(2 * kMatteRanks), others(2 * kMatteRanks);
  for (int order = 0; order < 6; ++order) {
    MatteFilm film;
    for (const auto& [cells, sums] : partials) {
      film.check(sums);
      film.fold(grid, cells, sums);
    }
    if (order == 0) first = bytes_of(film);
    EXPECT_EQ(bytes_of(film), first);
    ByteReader in(first, "test");
    MatteFilm restored;
    restored.read(&in, grid);
    EXPECT_EQ(bytes_of(restored), first);
    EXPECT_EQ(restored.attributes(kAllAovs), film.attributes(kAllAovs));
    for (size_t pixel = 0; pixel < kCellPixels; ++pixel) {
      film.ranks(4, pixel, kMaterialMatte, 40, ranks.data());
      restored.ranks(4, pixel, kMaterialMatte, 40, others.data());
      ASSERT_EQ(ranks, others);
    }
    std::next_permutation(partials.begin(), partials.end(), [](const auto& a, const auto& b) {
      return a.second.cells.size() < b.second.cells.size();
    });
  }
}

TEST(MatteFilm, RanksFallAndAddUp) {
  const FilmGrid grid = full_grid(32, 32);
  MatteSums sums;
  sums.names = {"a", "b", "c", "glass", "scene", "wood"};
  MatteCell cell;
  // Pixel 0: a 2, b 5 (in two materials), of 10 samples; the others nothing.
  cell.counts = {{matte_key(0, 3, 4), 2}, {matte_key(1, 3, 4), 4}, {matte_key(1, 5, 4), 1}};
  cell.ends.assign(kCellPixels, 3);
  sums.cells = {cell};
  MatteFilm film;
  film.fold(grid, grid.cells(), sums);
  float out[2 * kMatteRanks];
  film.ranks(0, 0, kObjectMatte, 10, out);
  EXPECT_EQ(out[0], cryptomatte_id("b"));
  EXPECT_EQ(out[1], 0.5f);
  EXPECT_EQ(out[2], cryptomatte_id("a"));
  EXPECT_EQ(out[3], 0.2f);
  for (int i = 4; i < 2 * kMatteRanks; ++i) EXPECT_EQ(out[i], 0);
  film.ranks(0, 0, kMaterialMatte, 10, out);
  EXPECT_EQ(out[0], cryptomatte_id("glass"));
  EXPECT_EQ(out[1], 0.6f);
  EXPECT_EQ(out[2], cryptomatte_id("wood"));
  EXPECT_EQ(out[3], 0.1f);
  film.ranks(0, 0, kAssetMatte, 10, out);
  EXPECT_EQ(out[1], 0.7f);
  EXPECT_EQ(out[3], 0);
  film.ranks(0, 1, kAssetMatte, 10, out);
  EXPECT_EQ(out[1], 0);
}

TEST(MatteFilm, ItsAttributesAreThoseOfTheSpecification) {
  const FilmGrid grid = grid_of();
  MatteFilm film;
  film.fold(grid, kCells, random_counts(grid, kCells, 9));
  const auto attributes = film.attributes(kAovCryptoObject | kAovCryptoAsset);
  ASSERT_EQ(attributes.size(), 8u);
  EXPECT_EQ(attributes.at("cryptomatte/3ae39a5/name"), "CryptoObject");
  EXPECT_EQ(attributes.at("cryptomatte/3ae39a5/hash"), "MurmurHash3_32");
  EXPECT_EQ(attributes.at("cryptomatte/3ae39a5/conversion"), "uint32_to_float32");
  EXPECT_EQ(attributes.at("cryptomatte/f42029d/name"), "CryptoAsset");
  const auto manifest = nlohmann::json::parse(attributes.at("cryptomatte/3ae39a5/manifest"));
  ASSERT_EQ(manifest.size(), std::size(kNames));
  for (const char* name : kNames) EXPECT_EQ(manifest.at(name), cryptomatte_hex(name));
  EXPECT_TRUE(film.attributes(kAovDepth).empty());
}

TEST(MatteFilm, MoreNamesThanASceneHasAreRefused) {
  const FilmGrid grid = full_grid(32, 32);
  MatteFilm film;
  MatteSums sums;
  // Each as long as names may be: the text is what is too much.
  const auto name = [](size_t i) {
    const std::string number = std::to_string(i);
    return std::string(kMaxMatteName - number.size(), 'x') + number;
  };
  const size_t most = kMaxMatteText / kMaxMatteName;
  for (size_t i = 0; i < most; ++i) sums.names.push_back(name(i));
  sums.cells.resize(1);
  film.check(sums);
  film.fold(grid, grid.cells(), sums);
  film.check(sums);
  sums.names = {name(most)};
  EXPECT_THROW(film.check(sums), Error);
}

TEST(MatteCodec, BytesThatNobodyWroteAreRefused) {
  const FilmGrid grid = grid_of();
  const MatteSums sums = random_counts(grid, kCells, 3);
  const std::string good = bytes_of(sums);
  const auto cells = static_cast<size_t>(kCells.count());
  ASSERT_EQ(decoded(good, cells), sums);
  check_mattes(sums, grid, kCells);
  uint64_t counts = 0;
  for (const MatteCell& cell : sums.cells) counts += cell.counts.size();
  EXPECT_LE(good.size(), max_matte_bytes(cells, counts));
  EXPECT_NO_THROW(decoded(good, cells, counts));
  EXPECT_THROW(decoded(good, cells, counts - 1), Error);
  EXPECT_THROW(decoded(good, cells + 1), Error);
  EXPECT_THROW(decoded(good, cells - 1), Error);
  for (size_t size = 0; size < good.size(); size += 1 + size / 50)
    EXPECT_THROW(decoded(std::string_view(good).substr(0, size), cells), Error) << size;
  std::mt19937_64 rng(4);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string bad = good;
    bad[i % 2 ? rng() % bad.size() : rng() % 120] = static_cast<char>(rng());
    try {
      const MatteSums other = decoded(bad, cells);
      check_mattes(other, grid, kCells);
      EXPECT_EQ(decoded(bytes_of(other), cells), other);
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(MatteCodec, OtherFormsAreRefused) {
  const FilmGrid grid = grid_of();
  const MatteSums good = random_counts(grid, kCells, 3);
  const auto refuses = [&](const auto& change) {
    MatteSums bad = good;
    change(bad);
    EXPECT_THROW(check_mattes(bad, grid, kCells), Error);
  };
  const size_t used =
      static_cast<size_t>(std::find_if(good.cells.begin(), good.cells.end(),
                                       [](const MatteCell& c) { return c.counts.size() > 1; }) -
                          good.cells.begin());
  refuses([](MatteSums& s) { s.cells.pop_back(); });
  refuses([](MatteSums& s) { std::swap(s.names[0], s.names[1]); });
  refuses([](MatteSums& s) { s.names.push_back("zzz of nothing"); });
  refuses([](MatteSums& s) { s.names.pop_back(); });
  refuses([](MatteSums& s) { s.names[0] = ""; });
  refuses([](MatteSums& s) { s.names[0] = "\n"; });
  refuses([](MatteSums& s) { s.names[0] = "\xff"; });
  refuses([&](MatteSums& s) { s.cells[used].counts[0].count = 0; });
  refuses([&](MatteSums& s) { s.cells[used].ends.pop_back(); });
  refuses([&](MatteSums& s) { s.cells[used].ends[3] += 5000; });
  refuses([&](MatteSums& s) {
    s.cells[0].ends.assign(kCellPixels, 1);
    s.cells[0].counts.resize(1);
  });
}

/// A partial that counts no more than its samples.
Partial partial_of(const FilmGrid& grid, uint64_t seed) {
  Partial p = testing::random_partial(grid, {grid.cells(), 0, 16}, seed, true, 0);
  p.aovs.spec.set = kAovsOfCryptomatte;
  p.mattes = random_counts(grid, grid.cells(), seed);
  return p;
}

TEST(MattePartial, GoesThroughTheCodecAndTheFilm) {
  const FilmGrid grid = grid_of();
  const Partial p = partial_of(grid, 5);
  const std::string bytes = encode_partial(p);
  EXPECT_EQ(decode_partial(bytes), p);
  Film film(grid);
  film.fold(p);
  const ChannelImage aovs = film.resolve_aovs();
  EXPECT_EQ(aovs.channels.size(), 3u * 2 * kMatteRanks);
  EXPECT_EQ(aovs.channels[0], "CryptoObject00.r");
  EXPECT_EQ(aovs.channels.back(), "CryptoAsset02.a");
  const Film restored = Film::restore(film.snapshot());
  EXPECT_EQ(restored.snapshot(), film.snapshot());
  EXPECT_EQ(restored.resolve_aovs().image.data, aovs.image.data);
  EXPECT_EQ(restored.resolve_aovs().attributes, aovs.attributes);
  EXPECT_EQ(aovs.attributes.size(), 12u);
}

TEST(MattePartial, MoreHitsThanSamplesAreRefused) {
  const FilmGrid grid = grid_of();
  Partial p = partial_of(grid, 6);
  p.mattes.cells[4].counts[7].count = 17;
  EXPECT_THROW(encode_partial(p), Error);
  p.mattes.cells[4].counts[7].count = ~uint64_t{0};
  EXPECT_THROW(encode_partial(p), Error);
  p = partial_of(grid, 6);
  p.aovs.spec.set = kAovDepth;  // nobody asked for the counts
  EXPECT_THROW(encode_partial(p), Error);
  p = partial_of(grid, 6);
  p.mattes = {};
  EXPECT_THROW(encode_partial(p), Error);
}

/// The same with numbers: by the name's length, so that two names share some.
Partial numbered_partial(const FilmGrid& grid, uint64_t seed) {
  Partial p = partial_of(grid, seed);
  p.aovs.spec.set = kAovsOfIds;
  for (const std::string& name : p.mattes.names) {
    const auto length = static_cast<uint32_t>(name.size());
    p.mattes.ids.push_back({length, kMaxThingId - length});
  }
  return p;
}

TEST(MatteIds, AreThoseThatMostSamplesHit) {
  const FilmGrid grid = grid_of();
  const Partial p = numbered_partial(grid, 8);
  EXPECT_EQ(decode_partial(encode_partial(p)), p);
  Film film(grid), twice(grid);
  film.fold(p);
  const ChannelImage aovs = film.resolve_aovs();
  ASSERT_EQ(aovs.channels, (std::vector<std::string>{"objectid.V", "materialid.V"}));
  EXPECT_TRUE(aovs.attributes.empty());
  const Film restored = Film::restore(film.snapshot());
  EXPECT_EQ(restored.snapshot(), film.snapshot());
  EXPECT_EQ(restored.resolve_aovs().image.data, aovs.image.data);
  MatteFilm counts;
  counts.fold(grid, grid.cells(), p.mattes);
  size_t ties = 0, hit = 0;
  const CellRect cells = grid.cells();
  for (size_t cell = 0; cell < static_cast<size_t>(cells.count()); ++cell) {
    for (size_t pixel = 0; pixel < kCellPixels; ++pixel) {
      std::map<uint32_t, uint64_t> sums;
      for (const MatteCount& entry : p.mattes.cells[cell].of(pixel))
        sums[p.mattes.ids[name_of(entry.key, kObjectMatte)].object] += entry.count;
      uint32_t best = 0;
      for (const auto& [id, count] : sums) {
        if (best == 0 || count > sums[best]) best = id;
        ties += best != id && count == sums[best];
      }
      hit += best != 0;
      ASSERT_EQ(counts.id(cell, pixel, kObjectMatte), best);
    }
  }
  EXPECT_GT(ties, 10u);
  EXPECT_GT(hit, 1000u);
}

TEST(MatteIds, OfOtherFormsAreRefused) {
  const FilmGrid grid = grid_of();
  const Partial good = numbered_partial(grid, 9);
  Film film(grid);
  film.fold(good);
  Partial other = good;
  other.tile.sample_begin = 16, other.tile.sample_end = 32;
  film.fold(other);
  other.mattes.ids[2].material += 1;
  EXPECT_THROW(film.fold(other), Error);
  for (const auto& change : std::vector<std::function<void(Partial&)>>{
           [](Partial& p) { p.mattes.ids.pop_back(); },
           [](Partial& p) { p.mattes.ids.clear(); },
           [](Partial& p) { p.mattes.ids[0].object = kMaxThingId + 1; },
           [](Partial& p) { p.aovs.spec.set = kAovsOfCryptomatte; },
       }) {
    Partial bad = good;
    change(bad);
    EXPECT_THROW(encode_partial(bad), Error);
  }
}

TEST(MatteNames, AreOneLineOfUtf8AndNotTooLong) {
  EXPECT_EQ(matte_name("Cube.001"), "Cube.001");
  EXPECT_EQ(matte_name("Würfel"), "Würfel");
  EXPECT_EQ(matte_name(""), kUnnamedMatte);
  for (const std::string& text : {std::string("a\tb"), std::string("a\xff"), std::string(1000, 'x'),
                                  std::string("\n"), std::string(300, '\xff')}) {
    EXPECT_FALSE(valid_matte_name(text));
    EXPECT_TRUE(valid_matte_name(matte_name(text))) << matte_name(text);
  }
  // Long ones that begin alike stay apart.
  EXPECT_NE(matte_name(std::string(1000, 'x') + "1"), matte_name(std::string(1000, 'x') + "2"));
}

TEST(MatteNames, ThoseThatAreTooManyAreOne) {
  MatteNames names;
  const uint32_t first = names.number("first");
  for (size_t i = 0; i < kMaxMatteNames + 10; ++i) names.number(std::to_string(i));
  EXPECT_EQ(names.names().size(), kMaxMatteNames);
  EXPECT_GT(names.left_out(), 10u);
  EXPECT_EQ(names.number("first"), first);
  EXPECT_EQ(names.names()[names.number("another")], kOtherMatte);
}

}  // namespace
}  // namespace lightmill
