// Arrays that move to files where memory is short.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

#include "common/base/error.h"
#include "common/base/spill/spill_array.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

constexpr uint64_t kMiB = uint64_t{1} << 20;

uint32_t value(size_t i) { return static_cast<uint32_t>(i) * 2654435761u; }
/// Appends values that tell their places until there are `count`.
void fill(size_t count, SpillArray<uint32_t>* array) {
  std::vector<uint32_t> some;
  while (array->size() < count) {
    some.clear();
    const size_t from = array->size(), until = std::min(count, from + 5000);
    for (size_t i = from; i < until; ++i) some.push_back(value(i));
    array->append(some.data(), some.size());
  }
}
void expect_values(const SpillArray<uint32_t>& array, size_t count) {
  ASSERT_EQ(array.size(), count);
  for (size_t i = 0; i < count; ++i) ASSERT_EQ(array.data()[i], value(i)) << i;
}
/// Bytes of mapped files that are in memory.
uint64_t mapped() {
  std::ifstream in("/proc/self/statm");
  uint64_t size = 0, resident = 0, shared = 0;
  in >> size >> resident >> shared;
  return shared * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

TEST(SpillArray, WithoutABoundItIsInMemory) {
  SpillArray<uint32_t> a;
  fill(3 * kMiB, &a);
  EXPECT_FALSE(a.in_file());
  EXPECT_GE(a.memory_bytes(), 12 * kMiB);
  expect_values(a, 3 * kMiB);
}

TEST(SpillArray, MovesToAFileWithoutANameWhereThereIsNoRoom) {
  const TemporaryFolder folder;
  const auto area = std::make_shared<SpillArea>(4 * kMiB, folder.file("new"));
  SpillArray<uint32_t> a(area);
  fill(kMiB / 2, &a);
  EXPECT_FALSE(a.in_file());
  fill(40 * kMiB, &a);  // files grow more than once
  EXPECT_TRUE(a.in_file());
  EXPECT_EQ(a.memory_bytes(), 0u);
  EXPECT_TRUE(std::filesystem::is_empty(folder.file("new")));
  expect_values(a, 40 * kMiB);
  SpillArray<uint32_t> moved;
  moved = std::move(a);
  expect_values(moved, 40 * kMiB);
}

TEST(SpillArray, ArraysShareTheBound) {
  const TemporaryFolder folder;
  const auto area = std::make_shared<SpillArea>(8 * kMiB, folder.file(""));
  SpillArray<uint32_t> first(area), third(area);
  fill(kMiB, &first);
  {
    SpillArray<uint32_t> second(area);
    fill(2 * kMiB, &second);
    EXPECT_TRUE(second.in_file());
  }
  EXPECT_FALSE(first.in_file());
  first = SpillArray<uint32_t>(area);
  fill(kMiB + kMiB / 2, &third);  // the first one's room is free again
  EXPECT_FALSE(third.in_file());
}

TEST(SpillArray, PagesOfFilesStayWithinTheBound) {
  const TemporaryFolder folder;
  const uint64_t before = mapped();
  SpillArray<uint32_t> a(std::make_shared<SpillArea>(8 * kMiB, folder.file("")));
  fill(32 * kMiB, &a);
  for (uint32_t& x : a.span()) x += 1;                              // each page is mapped and changed
  while (mapped() > before + 16 * kMiB) std::this_thread::yield();  // of 128 MiB; or this test hangs
  for (uint32_t& x : a.span()) x -= 1;
  expect_values(a, 32 * kMiB);
}

TEST(SpillArray, AFullDiskIsAnError) {
  const TemporaryFolder folder;
  SpillArray<uint32_t> a(std::make_shared<SpillArea>(kMiB, "/dev/null/folder"));
  EXPECT_THROW(fill(kMiB, &a), Error);
  EXPECT_LE(a.memory_bytes(), kMiB);

  // Files may not be larger than that.
  rlimit old{}, limit{};
  getrlimit(RLIMIT_FSIZE, &old);
  limit = {80 * kMiB, old.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  SpillArray<uint32_t> b(std::make_shared<SpillArea>(kMiB, folder.file("")));
  EXPECT_THROW(fill(64 * kMiB, &b), Error);
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, handler);
  EXPECT_GE(b.size(), 8 * kMiB);
  expect_values(b, b.size());  // what was there before is
}

}  // namespace
}  // namespace lightmill::test
