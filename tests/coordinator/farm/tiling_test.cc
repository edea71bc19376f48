// Rounds and tiles: whatever speed is measured, every sample of every cell is covered exactly once.
#include "coordinator/farm/tiling.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "common/error/checkpoints.h"

namespace lightmill {
namespace {

FilmGrid full(int width, int height) { return {width, height, {0, 0, width, height}}; }

/// Plays rounds up to spp with erratic speeds, workers and groups, as a farm in the wild would; an extension
/// comes in at `spp_first`.
std::vector<TileSpec> play(const FilmGrid& grid, int64_t spp_first, int64_t spp, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<TileSpec> all;
  int64_t previous = 0, begin = 0;
  for (int64_t target : {spp_first, spp}) {
    while (begin < target) {
      TilingInput in;
      in.grid = grid;
      in.begin = begin;
      in.spp = target;
      in.workers = static_cast<int>(random() % 9);
      in.worker_samples_per_second = random() % 4 == 0 ? 0 : std::exp2(static_cast<double>(random() % 24));
      in.previous_tile_samples = previous;
      in.max_superblocks = int64_t{1} << (random() % 4);
      in.splats = random() % 2 == 0;
      in.halves = random() % 2 == 0;
      in.min_tile_samples = random() % 4 == 0 ? static_cast<int64_t>(random() % 1000000) : 0;
      const std::vector<TileSpec> round = plan_round(in);
      EXPECT_FALSE(round.empty());
      if (round.empty()) return all;
      for (const TileSpec& tile : round) {
        EXPECT_EQ(tile.sample_begin, begin);
        EXPECT_EQ(tile.sample_end, round[0].sample_end);
        EXPECT_LE(tile.sample_end, target);
        all.push_back(tile);
      }
      previous = grid.crop.area() * round[0].samples() / static_cast<int64_t>(round.size());
      begin = round[0].sample_end;
    }
  }
  return all;
}

void expect_exact_cover(const FilmGrid& grid, int64_t spp, const std::vector<TileSpec>& tiles) {
  std::map<std::pair<int, int>, std::vector<int>> count;
  int64_t packets = 0;
  for (const TileSpec& tile : tiles) {
    packets += packets_completed(tile, spp);
    for (int y = tile.cells.y0; y < tile.cells.y1; ++y) {
      for (int x = tile.cells.x0; x < tile.cells.x1; ++x) {
        auto& samples = count[{x, y}];
        samples.resize(static_cast<size_t>(spp));
        for (int64_t s = tile.sample_begin; s < tile.sample_end; ++s) ++samples.at(static_cast<size_t>(s));
      }
    }
  }
  EXPECT_EQ(packets, grid.cells().count() * block_count(spp));
  ASSERT_EQ(static_cast<int64_t>(count.size()), grid.cells().count());
  for (const auto& [cell, samples] : count) {
    for (int n : samples) ASSERT_EQ(n, 1);
  }
}

TEST(Tiling, CoversEverySampleOfEveryCellOnce) {
  const FilmGrid crop{500, 300, {33, 40, 391, 297}};
  for (const FilmGrid& grid :
       {full(64, 64), full(300, 300), full(1, 20000), full(1, 1), full(1000, 20), crop}) {
    for (int64_t spp : {1, 2, 3, 7, 16, 17, 40, 50, 100}) {
      SCOPED_TRACE(::testing::Message() << grid.width << "x" << grid.height << " " << spp << " spp");
      expect_exact_cover(grid, spp, play(grid, spp, spp, static_cast<unsigned>(spp)));
    }
  }
}

TEST(Tiling, ExtensionsCoverToo) {
  const FilmGrid grid = full(200, 100);
  for (const auto& [first, total] : {std::pair{40, 80}, {1, 50}, {32, 64}, {5, 6}, {15, 17}, {33, 500}}) {
    SCOPED_TRACE(::testing::Message() << first << " to " << total);
    expect_exact_cover(grid, total, play(grid, first, total, 7));
  }
}

TEST(Tiling, RangesEndOnBlocksAndStayInsideAGroup) {
  TilingInput in;
  in.grid = full(64, 64);
  in.spp = 4000;
  in.worker_samples_per_second = 1e9;
  in.max_superblocks = 4;
  std::vector<int64_t> ends;
  while (in.begin < 2048) {
    const auto round = plan_round(in);
    in.begin = round.at(0).sample_end;
    in.previous_tile_samples = int64_t{64} * 64 * round[0].samples() / static_cast<int64_t>(round.size());
    ends.push_back(in.begin);
  }
  EXPECT_EQ((std::vector<int64_t>(ends.begin(), ends.begin() + 5)), (std::vector<int64_t>{1, 2, 4, 8, 16}));
  for (size_t i = 5; i < ends.size(); ++i) {
    EXPECT_EQ(ends[i] % 16, 0);
    EXPECT_EQ((ends[i - 1] / 16) / 4, (ends[i] / 16 - 1) / 4) << "crosses a group at " << ends[i];
  }
  EXPECT_EQ(ends.back() - ends[ends.size() - 2], 64) << "a fast farm takes whole groups";
}

TEST(Tiling, RoundsOfATargetEndAtEveryCheckpoint) {
  std::vector<int64_t> checkpoints;
  for (int64_t c = 0; c < 5000;) checkpoints.push_back(c = next_checkpoint(c));
  EXPECT_EQ((std::vector<int64_t>(checkpoints.begin(), checkpoints.begin() + 12)),
            (std::vector<int64_t>{1, 2, 4, 8, 16, 32, 48, 64, 80, 96, 112, 128}));
  for (size_t i = 8; i < checkpoints.size(); ++i) {
    EXPECT_LE(static_cast<double>(checkpoints[i]) / static_cast<double>(checkpoints[i - 1]), 1.25);
    EXPECT_EQ(next_checkpoint(checkpoints[i] - 1), checkpoints[i]);
  }
  for (const int64_t group : {1, 2, 8, 1024}) {
    TilingInput in;
    in.grid = full(64, 64);
    in.spp = 4900;
    in.worker_samples_per_second = 1e9;
    in.max_superblocks = group;
    in.to_checkpoint = true;
    std::set<int64_t> ends;
    while (in.begin < in.spp) {
      in.begin = plan_round(in).at(0).sample_end;
      ends.insert(in.begin);
    }
    for (const int64_t c : checkpoints) EXPECT_TRUE(c > in.spp || ends.contains(c)) << c;
  }
}

TEST(Tiling, TilesGrowAtMostTwofoldUpToTheTarget) {
  TilingInput in;
  in.grid = full(2048, 2048);
  in.spp = 10000;
  in.worker_samples_per_second = 1e6;
  in.target_tile_seconds = 2;
  double previous = 0;
  for (int i = 0; i < 40; ++i) {
    const auto round = plan_round(in);
    const double samples =
        static_cast<double>(in.grid.crop.area() * round.at(0).samples()) / static_cast<double>(round.size());
    if (i == 0) {
      EXPECT_LE(samples, 16 * kCellPixels);
    } else {
      EXPECT_LE(samples, previous * 2.001);
    }
    EXPECT_LE(samples, 2e6 * 1.001);
    previous = samples;
    in.previous_tile_samples = static_cast<int64_t>(samples);
    in.begin = round[0].sample_end;
  }
  EXPECT_GT(previous, 1e6);
}

TEST(Tiling, AtLeastTwoTilesPerWorkerWhereTheGridAllows) {
  TilingInput in;
  in.grid = full(320, 320);
  in.spp = 100;
  in.previous_tile_samples = 1 << 30;
  in.worker_samples_per_second = 1e12;
  for (int workers : {1, 3, 10, 50, 500}) {
    in.workers = workers;
    EXPECT_GE(plan_round(in).size(), std::min<size_t>(100, 2 * static_cast<size_t>(workers))) << workers;
  }
}

/// Tiles of every round of a job with splats, and how large each is, in samples.
std::vector<std::vector<double>> splat_rounds(TilingInput in) {
  in.splats = true;
  std::vector<std::vector<double>> rounds;
  while (in.begin < in.spp) {
    const auto round = plan_round(in);
    if (round.empty()) break;
    rounds.emplace_back();
    for (const TileSpec& tile : round)
      rounds.back().push_back(static_cast<double>(in.grid.pixels(tile.cells).area() * tile.samples()));
    in.previous_tile_samples = in.grid.crop.area() * round[0].samples() / static_cast<int64_t>(round.size());
    in.begin = round[0].sample_end;
  }
  return rounds;
}

TEST(Tiling, ATileOfOneCellIsAsDeepAsATargetTile) {
  TilingInput in;
  in.grid = full(320, 320);  // 100 cells
  in.begin = 512 * kSuperblockSamples;
  in.spp = 1 << 20;
  in.workers = 1000;  // whose two tiles each would be many more
  in.worker_samples_per_second = 20000;
  in.target_tile_seconds = 4;
  in.previous_tile_samples = 1 << 20;
  in.max_superblocks = 64;
  const std::vector<TileSpec> round = plan_round(in);
  ASSERT_EQ(round.size(), 100u);
  EXPECT_EQ(round[0].samples(), 8 * kSuperblockSamples);  // 6.6 s; four of them would be 3.3 s
  in.min_superblocks = 16;
  EXPECT_EQ(plan_round(in)[0].samples(), 16 * kSuperblockSamples) << "the ingest budget asks for more";
}

TEST(Tiling, SplatsMakeTilesLarge) {
  TilingInput in;
  in.grid = full(512, 512);
  in.spp = 16;
  in.workers = 2;
  in.worker_samples_per_second = 7e5;
  size_t tiles = 0;
  for (const auto& round : splat_rounds(in)) tiles += round.size();
  EXPECT_LE(tiles, 8u) << "each brings splats over the whole window";
  EXPECT_EQ(splat_rounds(in).size(), 2u) << "a first picture, and the rest";
  in.spp = 1600;
  const auto rounds = splat_rounds(in);
  const double window = 512 * 512;
  for (size_t i = 2; i < rounds.size(); ++i) {
    for (const double samples : rounds[i]) {
      EXPECT_LE(samples, 16 * window * 1.3) << "a partial is due now and then";
      EXPECT_GE(samples, 2 * window) << "and is worth its bytes";
    }
  }
  EXPECT_EQ(rounds[50].size(), 1u);
  EXPECT_GE(rounds.back().size(), 2u) << "both workers see the job's end";
  in.worker_samples_per_second = 1e4;  // sixteen seconds render 160,000
  for (const auto& round : splat_rounds(in)) {
    for (const double samples : round) EXPECT_LE(samples, 2.1e5);
  }
}

TEST(Tiling, EveryWorkerGetsATileOfTheSplatsThatAreLeft) {
  TilingInput in;
  in.grid = full(512, 512);
  in.spp = 16;
  in.begin = 8;
  in.splats = true;
  in.previous_tile_samples = 1 << 30;
  in.worker_samples_per_second = 1e7;
  for (int workers : {1, 3, 10, 50}) {
    in.workers = workers;
    EXPECT_GE(plan_round(in).size(), static_cast<size_t>(workers));
  }
  in.begin = 0;
  in.spp = 1 << 20;
  in.workers = 7;
  in.to_checkpoint = true;  // when it is looked at, nothing else can be leased
  for (const auto& round : splat_rounds(in)) EXPECT_GE(round.size(), 7u);
  in.to_checkpoint = false;
  in.begin = 1600;
  in.seconds_left = 0.05;  // 13 samples per pixel: no other round follows
  EXPECT_GE(plan_round(in).size(), 7u);
}

TEST(Tiling, TimeLimitCutsTheRoundToWhatFits) {
  TilingInput in;
  in.grid = full(1000, 1000);
  in.begin = 16;
  in.spp = 1000000;
  in.worker_samples_per_second = 1e6;
  in.previous_tile_samples = 1000000;
  in.seconds_left = 5.5;
  EXPECT_EQ(plan_round(in).at(0).samples(), 5);
  in.seconds_left = 0.6;
  EXPECT_EQ(plan_round(in).at(0).samples(), 1);
  in.seconds_left = 0.4;
  EXPECT_TRUE(plan_round(in).empty());
  in.begin = 0;
  EXPECT_FALSE(plan_round(in).empty()) << "a first picture is owed in any case";
}

TEST(SplitCells, PartitionsNearlyEvenly) {
  for (const CellRect& cells : {CellRect{0, 0, 10, 10}, {3, 5, 4, 630}, {0, 0, 32, 1}, {7, 7, 8, 8}}) {
    for (int64_t count : {1, 2, 3, 7, 20, 100, 5000}) {
      std::map<std::pair<int, int>, int> seen;
      int64_t smallest = 1 << 30, largest = 0;
      for (const CellRect& part : split_cells(cells, count)) {
        ASSERT_GT(part.count(), 0);
        smallest = std::min(smallest, part.count());
        largest = std::max(largest, part.count());
        for (int y = part.y0; y < part.y1; ++y) {
          for (int x = part.x0; x < part.x1; ++x) ++seen[{x, y}];
        }
      }
      ASSERT_EQ(static_cast<int64_t>(seen.size()), cells.count());
      for (const auto& [cell, n] : seen) ASSERT_EQ(n, 1);
      EXPECT_LE(largest, 4 * smallest);
    }
  }
}

TEST(Tiling, AnIngestBudgetAsksForDeeperRounds) {
  TilingInput in;
  in.grid = {256, 256, {0, 0, 256, 256}};
  in.begin = 128 * kSuperblockSamples;
  in.spp = 100000;
  in.workers = 4;
  in.worker_samples_per_second = 1e5;
  in.previous_tile_samples = 100000;
  EXPECT_EQ(plan_round(in)[0].sample_end, 129 * kSuperblockSamples);
  in.min_superblocks = 8;
  EXPECT_EQ(plan_round(in)[0].sample_end, 136 * kSuperblockSamples) << "also above max_superblocks";
  in.begin = 132 * kSuperblockSamples;
  EXPECT_EQ(plan_round(in)[0].sample_end, 136 * kSuperblockSamples) << "up to where they are aligned";
  in.min_superblocks = 32;
  EXPECT_EQ(plan_round(in)[0].sample_end, 160 * kSuperblockSamples) << "to where the other replicate begins";
  in.min_superblocks = 8;
  in.begin = 4;
  EXPECT_LE(plan_round(in)[0].sample_end, kSuperblockSamples) << "the first picture comes soon in any case";
  in.begin = 1024;
  in.splats = true;
  in.min_tile_samples = 2000000;
  EXPECT_LE(plan_round(in).size(), 5u) << "8.4 million samples";
  in.min_tile_samples = 40000000;
  EXPECT_EQ(plan_round(in).size(), 1u) << "however small the last tiles were";
}

TEST(Tiling, FilmsOfHalvesGetTwoOfThem) {
  TilingInput in;
  in.grid = full(64, 64);
  in.splats = in.halves = true;
  in.previous_tile_samples = 1 << 30;
  for (const auto& [spp, half] :
       {std::pair<int64_t, int64_t>{2, 1}, {4, 2}, {8, 4}, {12, 8}, {16, 8}, {1000, 8}}) {
    in.spp = spp;
    std::set<int64_t> ends;
    for (in.begin = 0; in.begin < std::min(spp, kSuperblockSamples);) {
      in.begin = plan_round(in)[0].sample_end;
      ends.insert(in.begin);
    }
    EXPECT_TRUE(ends.contains(half)) << spp;
  }
}

}  // namespace
}  // namespace lightmill
