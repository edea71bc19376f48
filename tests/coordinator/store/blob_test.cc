// Blobs that a disk damages or loses: they are found, go out of the store, and come back.
#include <gmock/gmock.h>

#include "coordinator/store/blob_check.h"
#include "coordinator/store/blob_scrub.h"
#include "coordinator/store/memory_job_store.h"
#include "tests/coordinator/store/blob_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

using DamagedBlobs = BlobFixture;

/// All bytes of a blob, in pieces of at most `most`.
std::string read_all(BlobStore::Reader& reader, size_t most) {
  std::string all;
  for (std::string_view bytes = reader.next(most); !bytes.empty(); bytes = reader.next(most)) {
    EXPECT_LE(bytes.size(), most);
    all += bytes;
  }
  return all;
}

TEST_F(DamagedBlobs, AReaderSeesWhatIsWrongAndTakesItOut) {
  const std::string good = put("good content"), bad = put("some content");
  damage(bad, "some kontent");
  std::optional<BlobStore::Reader> reader = blobs.open(good);
  EXPECT_EQ(reader->size(), 12u);
  EXPECT_EQ(read_all(*reader, 5), "good content");
  EXPECT_TRUE(reader->finish());
  reader = blobs.open(bad);
  EXPECT_EQ(read_all(*reader, 5), "some kontent");
  EXPECT_FALSE(reader->finish());
  EXPECT_FALSE(blobs.contains(bad));
  EXPECT_FALSE(blobs.open(bad));
  EXPECT_THAT(blobs.digests(), ElementsAre(good));
  EXPECT_EQ(blobs.damaged(), 1u);
  EXPECT_THAT(logged, ElementsAre(AllOf(HasSubstr(bad), HasSubstr("damaged"), HasSubstr("needed again"))));
  EXPECT_TRUE(std::filesystem::exists(file("damaged-" + bad))) << "to be looked at";
  put("some content");
  EXPECT_TRUE(blobs.verify(bad)) << "it has come again";
}

TEST_F(DamagedBlobs, ShorterAndLongerAndEmptyFilesAreDamaged) {
  for (const char* content : {"", "some", "some content and more"}) {
    const std::string digest = put("some content");
    damage(digest, content);
    EXPECT_FALSE(blobs.verify(digest)) << content;
    EXPECT_FALSE(blobs.contains(digest)) << content;
  }
  EXPECT_TRUE(blobs.verify(put(""))) << "an empty file is a file";
}

TEST_F(DamagedBlobs, OneThatCameWhileTheOldWasReadStays) {
  const std::string digest = put("some content");
  damage(digest, "some kontent");
  std::optional<BlobStore::Reader> reader = blobs.open(digest);
  put("some content");
  EXPECT_EQ(read_all(*reader, 100), "some kontent");
  EXPECT_FALSE(reader->finish()) << "who reads it must not go on";
  EXPECT_TRUE(blobs.contains(digest));
  EXPECT_EQ(blobs.damaged(), 0u);
}

TEST_F(DamagedBlobs, TheMissingAreThoseThatAreGoneOrNotRightAnyMore) {
  const std::string kept = put("kept"), gone = put("gone"), bad = put("good");
  const std::vector<std::string> all{kept, gone, bad};
  EXPECT_THAT(blobs.missing(all, 1000), IsEmpty());
  std::filesystem::remove(file(gone));
  damage(bad, "baad");
  EXPECT_THAT(blobs.missing(all, 3), ElementsAre(gone)) << "no more is read than was allowed";
  EXPECT_THAT(blobs.missing(all, 4), ElementsAre(gone, bad)) << "of those that were right nothing is read";
}

TEST_F(DamagedBlobs, ANewProcessLooksAtThemOnce) {
  const std::string kept = put("kept"), bad = put("good");
  damage(bad, "baad");
  BlobStore again(folder.file("blobs"));
  EXPECT_THAT(again.missing({kept}, 3), IsEmpty()) << "too long to be read";
  EXPECT_THAT(again.missing({kept, bad}, 8), ElementsAre(bad));
  EXPECT_THAT(again.missing({kept}, 0), IsEmpty());
}

TEST_F(DamagedBlobs, OnlyTheNewestAreKept) {
  for (size_t i = 0; i < BlobStore::kMostDamagedKept + 3; ++i) {
    const std::string digest = put("content " + std::to_string(i));
    damage(digest, "kontent");
    EXPECT_FALSE(blobs.verify(digest));
  }
  size_t kept = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.file("blobs")))
    kept += entry.path().filename().string().starts_with("damaged-");
  EXPECT_EQ(kept, BlobStore::kMostDamagedKept);
}

class Scrub : public BlobFixture {
 protected:
  /// Steps for so many simulated seconds.
  void run(double seconds) {
    const double end = now + seconds;
    while (due < end) {
      now = due;
      due = now + scrub.step(now);
    }
    now = end;
  }
  double now = 1000, due = 1000;
  BlobScrub scrub{blobs, 1e6};
};

TEST_F(Scrub, FindsWhatIsDamagedWithoutBeingAsked) {
  const std::string good = put(std::string(300'000, 'a')), bad = put(std::string(300'000, 'b'));
  damage(bad, std::string(300'000, 'c'));
  run(0.35);
  EXPECT_EQ(blobs.damaged(), bad < good ? 1u : 0u) << "a million bytes a second, no more";
  run(0.5);
  EXPECT_EQ(blobs.damaged(), 1u);
  EXPECT_THAT(blobs.digests(), ElementsAre(good));
}

TEST_F(Scrub, BeginsAPassEveryHourAtMost) {
  const std::string digest = put("some content");
  run(1);
  damage(digest, "some kontent");
  run(BlobScrub::kPassSeconds - 10);
  EXPECT_TRUE(blobs.contains(digest));
  run(20);
  EXPECT_FALSE(blobs.contains(digest));
  run(3 * BlobScrub::kPassSeconds);
  EXPECT_EQ(blobs.damaged(), 1u);
}

TEST_F(Scrub, GoesOnWhereABlobIsGoneMeanwhile) {
  const std::string a = put("a"), b = put("b");
  damage(std::max(a, b), "c");
  scrub.step(now);
  std::filesystem::remove(file(std::min(a, b)));
  run(10);
  EXPECT_THAT(blobs.digests(), IsEmpty());
}

class BlobCheck : public BlobFixture {
 protected:
  JobRecord add(const std::string& id, JobState state) {
    Bundle bundle;
    bundle.main = "scene.pbrt";
    bundle.entries = {{"scene.pbrt", sha256_hex("scene"), 5}, {"wood.png", sha256_hex("wood"), 4}};
    JobRecord job;
    job.id = JobId{id};
    job.state = state;
    job.bundle_digest = bundle.digest();
    store.add_job(job, bundle_to_json(bundle), {});
    return job;
  }
  MemoryJobStore store;
};

TEST_F(BlobCheck, HasNothingToSayOfWhatIsRight) {
  put("scene"), put("wood"), put("of no job");
  add("j1", JobState::kRunning);
  EXPECT_THAT(check_blobs(store, blobs), IsEmpty());
}

TEST_F(BlobCheck, NamesWhatIsDamagedAndWhatIsMissingAndWhoNeedsIt) {
  put("scene"), put("of no job");
  add("j1", JobState::kRunning);
  add("j2", JobState::kDone);
  damage(sha256_hex("scene"), "skene");
  damage(sha256_hex("of no job"), "");
  EXPECT_THAT(check_blobs(store, blobs),
              UnorderedElementsAre(AllOf(HasSubstr("job j1: wood.png (blob " + sha256_hex("wood") + ")"),
                                         HasSubstr("missing"), HasSubstr("submit")),
                                   AllOf(HasSubstr(file(sha256_hex("scene"))), HasSubstr("damaged"),
                                         HasSubstr("(scene.pbrt of job j1)")),
                                   AllOf(HasSubstr(file(sha256_hex("of no job"))), HasSubstr("damaged"))));
  EXPECT_EQ(blobs.digests().size(), 2u) << "it looks, and changes nothing";
}

TEST_F(BlobCheck, NamesAJobWhoseListOfFilesIsDamaged) {
  JobRecord job;
  job.id = JobId{"j1"};
  job.bundle_digest = "d";
  store.add_job(job, "{", {});
  EXPECT_THAT(check_blobs(store, blobs), ElementsAre(AllOf(HasSubstr("job j1"), HasSubstr("submit"))));
}

}  // namespace
}  // namespace lightmill
