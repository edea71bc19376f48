// Messages as another program (Python's protobuf, with the files of version 0.1) wrote them. A field whose
// number or type changes shows here: old peers must be understood well enough to be refused with a sentence.
#include <gtest/gtest.h>

#include "common/rpc/convert.h"
#include "lightmill/v1/client.pb.h"
#include "lightmill/v1/worker.pb.h"

namespace lightmill {
namespace {

template <class Message>
Message recorded(const std::string& hex) {
  std::string bytes;
  for (size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  Message message;
  EXPECT_TRUE(message.ParseFromString(bytes));
  EXPECT_TRUE(message.GetReflection()->GetUnknownFields(message).empty()) << "a field was removed";
  EXPECT_EQ(message.SerializeAsString(), bytes);
  return message;
}

TEST(RecordedMessages, Registration) {
  const auto m = recorded<v1::RegisterRequest>("0a100a016810041a016220012a0163320170");
  const WorkerRegistration r = from_proto(m.registration());
  EXPECT_EQ(r.host + r.build + r.arithmetic_class + r.pool, "hbcp");
  EXPECT_EQ(r.threads, 4);
  EXPECT_EQ(r.schema, 1);
}

TEST(RecordedMessages, ALeaseWithoutItsDigestIsSeenToBeWithoutOne) {
  const auto m = recorded<v1::LeaseResponse>(
      "0a2a0a080a026a3710051803120e0a080801100218032004101018201a027b7d220164290000000000002440");
  const LeaseKey key = from_proto(m.grant().key());
  EXPECT_EQ(key, (LeaseKey{JobId{"j7"}, TileId{5}, 3}));
  EXPECT_EQ(from_proto(m.grant().tile()), (TileSpec{{1, 2, 3, 4}, 16, 32}));
  EXPECT_EQ(m.grant().settings_json(), "{}");
  EXPECT_EQ(m.grant().bundle_digest(), "d");
  EXPECT_EQ(m.grant().lease_seconds(), 10);
  EXPECT_NE(m.grant().digest(), grant_digest(m.grant()));
}

TEST(RecordedMessages, Commit) {
  const auto m = recorded<v1::CommitRequest>("0a150a0377313212080a026a371005180318e807220165");
  EXPECT_EQ(m.header().worker_id(), "w12");
  EXPECT_EQ(from_proto(m.header().key()), (LeaseKey{JobId{"j7"}, TileId{5}, 3}));
  EXPECT_EQ(m.header().size(), 1000u);
  EXPECT_EQ(m.header().digest(), "e");
  const auto answer = recorded<v1::CommitResponse>("080412016d");
  EXPECT_EQ(from_proto(answer.outcome()), CommitResult::kCorrupt);
  EXPECT_EQ(answer.message(), "m");
}

TEST(RecordedMessages, Submission) {
  const auto m =
      recorded<v1::SubmitJobRequest>("0a016e1201621a017320feffffffffffffffff012a017032070a016410031802");
  EXPECT_EQ(m.name() + m.bundle_json() + m.settings_json() + m.pool(), "nbsp");
  EXPECT_EQ(m.priority(), -2);
  EXPECT_EQ(m.reference().width(), 3);
  EXPECT_EQ(m.reference().height(), 2);
}

TEST(RecordedMessages, Job) {
  const auto m = recorded<v1::JobStatus>(
      "0a026a3712016e180322016d2a027b7d32016438ffffffffffffffffff01420170480250095801600268037100000000"
      "0000f83f79000000000000044081010000000000000c4089010000000000001240910100000000000016409901000000"
      "000000d03fb2010408013807b80102c0010b");
  EXPECT_EQ(m.id() + m.name() + m.message(), "j7nm");
  EXPECT_EQ(from_proto(m.state()), JobState::kPaused);
  EXPECT_EQ(m.packets_done(), 2);
  EXPECT_EQ(m.packets_total(), 9);
  EXPECT_EQ(m.leases_reassigned(), 3);
  EXPECT_EQ(m.spp(), 1.5);
  EXPECT_EQ(m.eta_seconds(), 5.5);
  EXPECT_EQ(m.relmse(), 0.25);
  EXPECT_EQ(m.counters().nonfinite(), 7u);
  EXPECT_EQ(m.dropped_size(), 0);
  EXPECT_EQ(m.version(), 11u);
}

}  // namespace
}  // namespace lightmill
