// A worker that lies, over gRPC: its partials are made from the format alone, with every digest right. All of
// them are refused with the reason, kept as evidence within bounds and counted, the liar is benched, and the
// image is right.
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <zstd.h>

#include <cstring>
#include <filesystem>
#include <limits>

#include "common/base/digest.h"
#include "common/rpc/channel.h"
#include "common/rpc/convert.h"
#include "coordinator/http/metrics.h"
#include "coordinator/merge/quarantine.h"
#include "coordinator/server.h"
#include "coordinator/store/memory_job_store.h"
#include "lightmill/v1/worker.grpc.pb.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

// The encoding, as common/film/partial_codec.cc describes it.
constexpr size_t kHead = 8, kHeadBytes = 138, kCpu = kHead + kHeadBytes, kPayloadSize = kCpu + 8;
constexpr size_t kContentDigest = kPayloadSize + 8, kHeadDigest = kContentDigest + 64,
                 kFrame = kHeadDigest + 64;
// Within the head: eleven 32-bit numbers, the sample range, nine counts.
constexpr size_t kGridWidth = kHead, kSampleEnd = kHead + 44 + 8, kLightPaths = kHead + 60;
constexpr size_t kCameraPaths = kLightPaths + 8, kTracedLightPaths = kLightPaths + 16,
                 kNonfinite = kLightPaths + 56;

std::string compressed(const std::string& raw) {
  std::string packed(ZSTD_compressBound(raw.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), raw.data(), raw.size(), 1));
  return packed;
}
std::string payload_of(const std::string& partial) {
  uint64_t size = 0;
  std::memcpy(&size, partial.data() + kPayloadSize, 8);
  std::string raw(size, '\0');
  EXPECT_EQ(ZSTD_decompress(raw.data(), raw.size(), partial.data() + kFrame, partial.size() - kFrame), size);
  return raw;
}
/// Both digests made right again for the head and for `payload`.
std::string signed_again(std::string partial, const std::string& payload) {
  partial.replace(kContentDigest, 64, sha256_hex(partial.substr(kHead, kHeadBytes) + payload));
  return partial.replace(kHeadDigest, 64, sha256_hex(partial.substr(0, kHeadDigest)));
}
template <class T>
std::string with(std::string partial, size_t at, T value) {
  const std::string payload = payload_of(partial);
  std::memcpy(partial.data() + at, &value, sizeof value);
  return signed_again(std::move(partial), payload);
}
std::string with_payload(std::string partial, const std::string& payload) {
  const uint64_t size = payload.size();
  std::memcpy(partial.data() + kPayloadSize, &size, 8);
  partial.resize(kFrame);
  return signed_again(std::move(partial), payload) + compressed(payload);
}

class HostileWorker : public ::testing::Test {
 protected:
  HostileWorker() {
    start();
    liar = enter();
    honest = enter();
  }
  void start() {
    FarmOptions options = fake_options();
    options.max_attempts = 1000;
    options.quarantine = [this](const LeaseKey& lease, const WorkerId& worker, const std::string& why,
                                const std::string& bytes) { quarantine.keep(lease, worker, why, bytes); };
    farm = std::make_unique<Farm>(std::make_unique<MemoryJobStore>(), clock, options);
    ServerOptions listen;
    listen.listen = "127.0.0.1:0";
    listen.http = "";
    server = std::make_unique<Server>(listen, *farm, blobs);
    stub = v1::WorkerService::NewStub(make_channel({"127.0.0.1:" + std::to_string(server->rpc_port())}));
    job = farm->submit(request);
  }
  std::string enter() {
    v1::RegisterRequest hello;
    *hello.mutable_registration() = to_proto(registration());
    v1::RegisterResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(stub->Register(&context, hello, &response).ok());
    return response.worker_id();
  }
  std::optional<LeaseGrant> lease(const std::string& worker) {
    v1::LeaseRequest ask;
    ask.set_worker_id(worker);
    v1::LeaseResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(stub->Lease(&context, ask, &response).ok());
    if (!response.has_grant()) return std::nullopt;
    return from_proto(response.grant());
  }
  /// What the liar gets, past being benched.
  LeaseGrant lease_for_the_liar() {
    for (int patience = 0; patience < 20; ++patience) {
      if (const auto grant = lease(liar)) return *grant;
      clock.advance(1000);
    }
    throw std::runtime_error("no lease");
  }
  v1::CommitResponse commit(const std::string& worker, const LeaseKey& key, const std::string& bytes) {
    v1::CommitResponse response;
    grpc::ClientContext context;
    set_deadline(context, 30);
    const auto writer = stub->Commit(&context, &response);
    v1::CommitRequest message;
    message.mutable_header()->set_worker_id(worker);
    *message.mutable_header()->mutable_key() = to_proto(key);
    message.mutable_header()->set_size(bytes.size());
    message.mutable_header()->set_digest(sha256_hex(bytes));
    writer->Write(message);
    message.set_chunk(bytes);
    writer->Write(message);
    writer->WritesDone();
    status = writer->Finish();
    return response;
  }
  static LeaseKey key(const LeaseGrant& grant) { return {grant.job, grant.tile_id, grant.attempt}; }
  void finish_honestly() {
    clock.advance(11);
    while (const auto grant = lease(honest)) {
      ASSERT_EQ(commit(honest, key(*grant), fake_bytes(*grant)).outcome(), v1::COMMIT_OUTCOME_ACCEPTED);
    }
    EXPECT_EQ(farm->job(job).state, JobState::kDone);
    EXPECT_TRUE(same_pixels(farm->image(job), fake_image(request.settings)));
  }

  TemporaryFolder folder;
  FakeClock clock;
  BlobStore blobs{folder.file("blobs")};
  Quarantine quarantine{folder.file("quarantine")};
  JobRequest request = small_job(96, 64, 24);
  std::unique_ptr<Farm> farm;
  std::unique_ptr<Server> server;
  std::unique_ptr<v1::WorkerService::Stub> stub;
  JobId job;
  std::string liar, honest;
  grpc::Status status;  // of the last commit
};

using Lie = std::function<std::string(const std::string&)>;
const std::vector<std::pair<const char*, Lie>>& lies() {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  static const std::vector<std::pair<const char*, Lie>> all = {
      {"wrong digest",
       [](std::string p) {
         return p[kContentDigest] ^= 1, p.replace(kHeadDigest, 64, sha256_hex(p.substr(0, kHeadDigest)));
       }},
      {"wrong digest", [](std::string p) { return p[kHeadDigest] ^= 1, p; }},
      {"another tile",
       [](const std::string& p) {
         int64_t end = 0;
         std::memcpy(&end, p.data() + kSampleEnd, 8);
         return with(p, kSampleEnd, end + 1);
       }},
      {"another film", [](const std::string& p) { return with(p, kGridWidth, int32_t{97}); }},
      {"another film",
       [](const std::string& p) { return with(with(p, kGridWidth, 65536), kGridWidth + 4, 4096); }},
      {"resolution", [](const std::string& p) { return with(p, kGridWidth, -5); }},
      {"camera paths", [](const std::string& p) { return with(p, kCameraPaths, uint64_t{1}); }},
      {"light paths", [](const std::string& p) { return with(p, kTracedLightPaths, uint64_t{7}); }},
      {"light paths", [](const std::string& p) { return with(p, kLightPaths, uint64_t{7}); }},
      {"more paths", [](const std::string& p) { return with(p, kLightPaths, ~uint64_t{0}); }},
      {"counter", [](const std::string& p) { return with(p, kNonfinite, ~uint64_t{0}); }},
      {"cpu_seconds", [nan](const std::string& p) { return with(p, kCpu, nan); }},
      {"cpu_seconds", [](const std::string& p) { return with(p, kCpu, -1.0); }},
      {"CPU time", [](const std::string& p) { return with(p, kCpu, 1e300); }},
      // A frame of 64 MiB that says so, one that is announced as small, and a payload that is announced as
      // huge.
      {"size", [](const std::string& p) { return with_payload(p, std::string(64 << 20, '\0')); }},
      {"size",
       [](const std::string& p) { return p.substr(0, kFrame) + compressed(std::string(64 << 20, '\0')); }},
      {"size", [](const std::string& p) { return with(p, kPayloadSize, uint64_t{1} << 60); }},
      {"", [](const std::string& p) { return with_payload(p, std::string(payload_of(p).size(), '\xff')); }},
      {"", [](const std::string& p) { return p.substr(0, 50); }},
      {"truncated", [](const std::string&) { return std::string(); }},
      {"", [](const std::string& p) { return p + p; }},
  };
  return all;
}

TEST_F(HostileWorker, NoLieIsFoldedAndAllAreKept) {
  rusage before{};
  getrusage(RUSAGE_SELF, &before);
  int told = 0;
  for (const auto& [reason, lie] : lies()) {
    const LeaseGrant grant = lease_for_the_liar();
    const std::string bytes = lie(fake_bytes(grant));
    const v1::CommitResponse answer = commit(liar, key(grant), bytes);
    EXPECT_EQ(answer.outcome(), v1::COMMIT_OUTCOME_CORRUPT) << "lie " << told;
    EXPECT_THAT(answer.message(), HasSubstr(reason)) << "lie " << told;
    ++told;
  }
  rusage after{};
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 400 << 10)
      << "kilobytes; the lies themselves are 64 MiB each";
  const FarmStats stats = farm->stats();
  EXPECT_EQ(stats.commits, 0u);
  EXPECT_EQ(stats.commits_corrupt, static_cast<uint64_t>(told));
  EXPECT_EQ(farm->workers()[0].partials_refused, told);
  EXPECT_THAT(Metrics(*farm).text(), HasSubstr("outcome=\"corrupt\"} " + std::to_string(told)));
  size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.file("quarantine")))
    files += entry.file_size() > 0 || entry.path().extension() == ".partial";
  EXPECT_EQ(files, static_cast<size_t>(2 * told));
  finish_honestly();
}

TEST_F(HostileWorker, IsBenchedAfterThreeLiesAlsoBetweenGoodTiles) {
  const auto lies_in_a_row = [&](int good_between) {
    for (int n = 1; n < 100; ++n) {
      for (int good = 0; good < good_between; ++good) {
        const auto grant = lease(liar);
        if (!grant) return n - 1;
        EXPECT_EQ(commit(liar, key(*grant), fake_bytes(*grant)).outcome(), v1::COMMIT_OUTCOME_ACCEPTED);
      }
      const auto grant = lease(liar);
      if (!grant) return n - 1;
      commit(liar, key(*grant), "rubbish");
    }
    return 100;
  };
  EXPECT_EQ(lies_in_a_row(0), 3);
  EXPECT_EQ(farm->workers()[0].state, "benched");
  clock.advance(31);
  liar = enter();  // a new name does not make it honest
  EXPECT_LE(lies_in_a_row(1), 6);
  finish_honestly();
}

TEST_F(HostileWorker, CannotCommitWhatItWasNotLeased) {
  const LeaseGrant theirs = lease(honest).value();
  const LeaseGrant mine = lease(liar).value();
  const auto outcome = [&](const std::string& worker, LeaseKey name, const LeaseGrant& content) {
    return commit(worker, name, fake_bytes(content)).outcome();
  };
  EXPECT_EQ(outcome(liar, key(theirs), theirs), v1::COMMIT_OUTCOME_STALE) << "somebody else's lease";
  for (const int64_t attempt : {int64_t{2}, std::numeric_limits<int64_t>::max()}) {
    EXPECT_EQ(outcome(liar, {mine.job, mine.tile_id, attempt}, mine), v1::COMMIT_OUTCOME_STALE);
  }
  EXPECT_EQ(outcome(liar, {mine.job, TileId{int64_t{1} << 40}, 1}, mine), v1::COMMIT_OUTCOME_UNKNOWN_JOB);
  for (const LeaseKey& nonsense : {LeaseKey{mine.job, TileId{-1}, 1}, LeaseKey{mine.job, mine.tile_id, 0},
                                   LeaseKey{mine.job, TileId{std::numeric_limits<int64_t>::min()}, -1}}) {
    outcome(liar, nonsense, mine);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  }
  EXPECT_EQ(outcome(liar, {JobId{"j99"}, mine.tile_id, 1}, mine), v1::COMMIT_OUTCOME_UNKNOWN_JOB);
  EXPECT_EQ(outcome(liar, key(mine), theirs), v1::COMMIT_OUTCOME_CORRUPT) << "the bytes of another tile";
  for (const std::string& name : {std::string("w999"), honest.substr(0, honest.find('.'))}) {
    outcome(name, key(theirs), theirs);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND) << "nobody, or another one without its key";
  }
  EXPECT_EQ(outcome(honest, key(theirs), theirs), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_EQ(outcome(liar, key(theirs), theirs), v1::COMMIT_OUTCOME_STALE) << "what is committed already";
  finish_honestly();
}

TEST_F(HostileWorker, EvidenceStaysWithinItsBounds) {
  for (int i = 0; i < 100; ++i)
    quarantine.keep({job, TileId{i}, 1}, WorkerId{"../../w"}, "why", std::string(5000, 'x'));
  quarantine.keep({job, TileId{0}, 1}, WorkerId{"w"}, "\xff", std::string(200 << 20, 'x'));
  Quarantine again(folder.file("quarantine"));  // after a restart
  again.keep({job, TileId{0}, 1}, WorkerId{"w"}, "last", "short");
  uint64_t files = 0, bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.file("quarantine"))) {
    ++files;
    bytes += entry.file_size();
  }
  EXPECT_EQ(files, 2 * Quarantine::kMostEntries);
  EXPECT_LE(bytes, Quarantine::kMostBytes + (1 << 20));
  EXPECT_TRUE(std::filesystem::exists(folder.file("quarantine/00000102.json")));
}

}  // namespace
}  // namespace lightmill
