// What is encoded is large: nothing may copy it as a whole on the way. Counts what this program allocates.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

#include "common/error/batch_film.h"
#include "common/film/film.h"
#include "tests/common/film/test_partials.h"

namespace {

std::atomic<size_t> live{0}, peak{0};

void* counted(size_t bytes) {
  auto* block = static_cast<size_t*>(std::malloc(bytes + alignof(std::max_align_t)));
  if (!block) throw std::bad_alloc();
  *block = bytes;
  const size_t now = live += bytes;
  for (size_t seen = peak; now > seen && !peak.compare_exchange_weak(seen, now);) {
  }
  return reinterpret_cast<char*>(block) + alignof(std::max_align_t);
}

void release(void* pointer) {
  if (!pointer) return;
  auto* block = reinterpret_cast<size_t*>(static_cast<char*>(pointer) - alignof(std::max_align_t));
  live -= *block;
  std::free(block);
}

}  // namespace

void* operator new(size_t bytes) { return counted(bytes); }
void operator delete(void* pointer) noexcept { release(pointer); }
void operator delete(void* pointer, size_t) noexcept { release(pointer); }

namespace lightmill {
namespace {

/// Most bytes that `work` had allocated at a time.
template <class Work>
double needs(const Work& work) {
  const size_t before = live;
  peak = before;
  work();
  return static_cast<double>(peak - before);
}

class CodecMemory : public ::testing::Test {
 protected:
  const FilmGrid grid = testing::full_grid(640, 480);
  const Partial partial = testing::random_partial(grid, {grid.cells(), 0, 16}, 3, true, 1);
  // Two layers of sums without structure; the compressed bytes are reserved, as large as these at worst.
  const double planes = static_cast<double>(encode_partial(partial).size());
};

TEST_F(CodecMemory, APartialIsEncodedPieceByPiece) {
  ASSERT_GT(planes, 5e6);
  EXPECT_LT(needs([&] { encode_partial(partial); }), 1.5 * planes);
  EXPECT_LT(needs([&] { partial_digest(partial); }), 0.4 * planes);
}

TEST_F(CodecMemory, ASnapshotIsSealedPieceByPiece) {
  Film film(grid);
  film.fold(partial);
  EXPECT_LT(needs([&] { film.snapshot(); }), 1.5 * planes);
  BatchFilm batches(grid);
  batches.fold(partial);
  const double sums = static_cast<double>(BatchFilm::kMaxTrackedPixels) * 3 * sizeof(float);
  EXPECT_LT(needs([&] { batches.snapshot(); }), 1.2 * sums);
}

}  // namespace
}  // namespace lightmill
