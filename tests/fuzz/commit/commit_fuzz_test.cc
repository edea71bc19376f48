// Smoke fuzz of Commit: a mutated partial is never accepted unless it is the same bytes, nothing crashes, and
// the job still gets the right pixels.
#include <gtest/gtest.h>

#include <random>

#include "coordinator/store/memory_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill {
namespace {

using namespace testing;

std::string mutated(const std::string& good, std::mt19937& random) {
  std::string bytes = good;
  const auto at = [&] { return random() % std::max<size_t>(1, bytes.size()); };
  for (size_t n = 1 + random() % 3; n > 0; --n) {
    switch (random() % 7) {
      case 0:  // a bit
        if (!bytes.empty()) bytes[at()] = static_cast<char>(bytes[at()] ^ (1 << (random() % 8)));
        break;
      case 1:  // a byte
        if (!bytes.empty()) bytes[at()] = static_cast<char>(random());
        break;
      case 2:  // truncation
        bytes.resize(at());
        break;
      case 3:  // more behind
        bytes.append(random() % 100, static_cast<char>(random()));
        break;
      case 4:  // a stretch is missing
        if (!bytes.empty()) bytes.erase(at(), random() % 16);
        break;
      case 5:  // a word of ones: lengths and counts
        if (bytes.size() > 8) bytes.replace(random() % (bytes.size() - 8), 4, "\xff\xff\xff\x7f");
        break;
      default:  // mostly in the header
        if (!bytes.empty())
          bytes[random() % std::min<size_t>(64, bytes.size())] = static_cast<char>(random());
    }
  }
  return bytes;
}

TEST(CommitFuzz, MutatedPartialsAreNeverAccepted) {
  const FakeClock clock;
  FarmOptions options = fake_options();
  options.max_attempts = 1 << 20;
  Farm farm(std::make_unique<MemoryJobStore>(), clock, options);
  std::mt19937 random(20240611);
  const JobRequest request = small_job(64, 33, 8);
  const JobId job = farm.submit(request);
  WorkerId worker = farm.register_worker(registration());
  int refused = 0;
  for (int i = 0; i < 20000; ++i) {
    auto grant = farm.lease(worker);
    if (!grant && farm.job(job).state == JobState::kDone) break;
    if (!grant) {  // benched for handing in rubbish; another one goes on
      worker = farm.register_worker(registration());
      continue;
    }
    const std::string good = fake_bytes(*grant);
    const std::string bytes = i % 400 == 399 ? good : mutated(good, random);
    const CommitResult result = farm.commit(worker, {grant->job, grant->tile_id, grant->attempt}, bytes);
    ASSERT_EQ(result == CommitResult::kAccepted, bytes == good);
    if (result == CommitResult::kCorrupt) ++refused;
  }
  EXPECT_GT(refused, 1000);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

TEST(CommitFuzz, RandomBytesAreNeverAccepted) {
  const FakeClock clock;
  FarmOptions options = fake_options();
  options.max_attempts = 1 << 20;
  Farm farm(std::make_unique<MemoryJobStore>(), clock, options);
  farm.submit(small_job(64, 33, 8));
  std::mt19937 random(7);
  for (int i = 0; i < 2000; ++i) {
    const WorkerId worker = farm.register_worker(registration());
    const auto grant = farm.lease(worker);
    ASSERT_TRUE(grant);
    std::string bytes(random() % 300, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    ASSERT_EQ(farm.commit(worker, {grant->job, grant->tile_id, grant->attempt}, bytes),
              CommitResult::kCorrupt);
  }
}

}  // namespace
}  // namespace lightmill
