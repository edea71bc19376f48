#include "worker/agent/blob_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/base/size_text.h"
#include "tests/worker/agent/fake_farm.h"
#include "tests/worker/agent/temporary_folder.h"
#include "worker/agent/memory_size.h"

namespace lightmill::agent {
namespace {

using testing::FakeFarm;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

class BlobCacheTest : public ::testing::Test {
 protected:
  /// A bundle of files of these contents; the farm can send them.
  Bundle make(const std::vector<std::pair<std::string, std::string>>& files) {
    Bundle bundle;
    bundle.main = files.front().first;
    for (const auto& [name, content] : files) {
      bundle.entries.push_back({name, sha256_hex(content), content.size()});
      farm_.blobs[bundle.entries.back().digest] = content;
    }
    return bundle;
  }
  std::string content(const BundleEntry& entry) {
    std::ifstream in(folder_.path / blob_file_name(entry), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  int files() const {
    const std::filesystem::directory_iterator all(folder_.path);
    return static_cast<int>(std::distance(begin(all), end(all)));
  }
  std::string error_of(BlobCache& cache, const Bundle& bundle) {
    try {
      cache.ensure(bundle, farm_);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder_;
  FakeFarm farm_;
};

TEST_F(BlobCacheTest, FetchesWhatIsMissingOnce) {
  const Bundle bundle = make({{"a.pbrt", "scene"}, {"m.ply", "mesh"}});
  BlobCache cache(folder_.path, 1000);
  cache.ensure(bundle, farm_);
  EXPECT_EQ(content(bundle.entries[0]), "scene");
  EXPECT_EQ(content(bundle.entries[1]), "mesh");
  cache.ensure(bundle, farm_);
  EXPECT_EQ(farm_.blobs_sent, 2);
  const Bundle more = make({{"a.pbrt", "scene"}, {"n.ply", "another"}});
  BlobCache(folder_.path, 1000).ensure(more, farm_);  // another process
  EXPECT_EQ(farm_.blobs_sent, 3);
}

TEST_F(BlobCacheTest, OneContentUnderTwoNamesIsFetchedOnce) {
  const Bundle bundle = make({{"a.png", "same"}, {"b.exr", "same"}});
  BlobCache cache(folder_.path, 1000);
  cache.ensure(bundle, farm_);
  EXPECT_EQ(farm_.blobs_sent, 1);
  for (const BundleEntry& entry : bundle.entries) EXPECT_EQ(content(entry), "same");
}

TEST_F(BlobCacheTest, ADamagedBlobIsRefusedAndLeavesNothing) {
  const Bundle bundle = make({{"a.pbrt", "scene"}});
  farm_.blobs[bundle.entries[0].digest] = "scenf";
  BlobCache cache(folder_.path, 1000);
  EXPECT_THAT(error_of(cache, bundle), HasSubstr("damaged"));
  farm_.blobs[bundle.entries[0].digest] = "scene and more";
  EXPECT_THAT(error_of(cache, bundle), HasSubstr("another size"));
  EXPECT_EQ(files(), 0);
}

TEST_F(BlobCacheTest, ADamagedFileOnDiskIsFetchedAgain) {
  const Bundle bundle = make({{"a.pbrt", "scene"}});
  BlobCache(folder_.path, 1000).ensure(bundle, farm_);
  std::ofstream(folder_.path / blob_file_name(bundle.entries[0])) << "scenf";
  BlobCache(folder_.path, 1000).ensure(bundle, farm_);
  EXPECT_EQ(content(bundle.entries[0]), "scene");
}

TEST_F(BlobCacheTest, TheLeastRecentlyUsedGoesFirst) {
  const Bundle a = make({{"a.pbrt", "aaaaaaaaaa"}}), b = make({{"b.pbrt", "bbbbbbbbbb"}}),
               c = make({{"c.pbrt", "cccccccccc"}});
  BlobCache cache(folder_.path, 25);
  cache.ensure(a, farm_);
  cache.ensure(b, farm_);
  const auto old = std::filesystem::file_time_type::clock::now() - std::chrono::hours(1);
  std::filesystem::last_write_time(folder_.path / blob_file_name(b.entries[0]), old);
  cache.ensure(c, farm_);
  EXPECT_EQ(files(), 2);
  EXPECT_EQ(content(a.entries[0]), "aaaaaaaaaa");
  EXPECT_EQ(content(b.entries[0]), "");
  cache.ensure(b, farm_);
  EXPECT_EQ(content(b.entries[0]), "bbbbbbbbbb");
}

TEST_F(BlobCacheTest, ASceneLargerThanTheCacheNamesTheOption) {
  const Bundle bundle = make({{"a.pbrt", "0123456789"}});
  BlobCache cache(folder_.path, 5);
  EXPECT_THAT(error_of(cache, bundle), HasSubstr("--cache-size"));
  EXPECT_EQ(farm_.blobs_sent, 0);
}

TEST_F(BlobCacheTest, AFolderThatCannotBeMadeIsNamed) {
  EXPECT_THROW(BlobCache("/proc/none/blobs", 5), Error);
}

TEST(SizeText, TakesSuffixesAndRefusesNonsense) {
  EXPECT_EQ(parse_size("10G", "--cache-size"), uint64_t{10} << 30);
  EXPECT_EQ(parse_size("1.5k", "--cache-size"), 1536u);
  EXPECT_EQ(parse_size("500MB", "--cache-size"), uint64_t{500} << 20);
  EXPECT_EQ(parse_size("7", "--cache-size"), 7u);
  EXPECT_EQ(parse_memory("7", "--scene-memory"), uint64_t{7} << 20);
  EXPECT_EQ(parse_memory("7K", "--scene-memory"), uint64_t{7} << 10);
  EXPECT_EQ(parse_memory("none", "--scene-memory"), ~uint64_t{0});
  EXPECT_GT(parse_memory("auto", "--scene-memory"), uint64_t{1} << 20);
  EXPECT_THROW(parse_memory("much", "--scene-memory"), Error);
  for (const char* bad : {"", "x", "-1", "0", "10X", "10GiB", "nan", "inf", "1e99", "G"}) {
    EXPECT_THROW(parse_size(bad, "--cache-size"), Error) << bad;
  }
}

}  // namespace
}  // namespace lightmill::agent
