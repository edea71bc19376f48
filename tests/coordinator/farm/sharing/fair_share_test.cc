// The arithmetic of sharing, and of who may have a film in memory.
#include "coordinator/farm/sharing/fair_share.h"

#include <gtest/gtest.h>

#include "coordinator/farm/sharing/film_admission.h"

namespace lightmill {
namespace {

struct Contender {
  JobRecord record;
  JobShare share;
};
Contender contender(const std::string& id, const std::string& submitter) {
  Contender c;
  c.record.id = JobId{id};
  c.record.submitter = submitter;
  return c;
}

TEST(FairShare, WhoComesLateBeginsLevelWithTheLeastServed) {
  FairShare shares;
  Contender big = contender("j1", "ann"), other = contender("j2", "ann"), late = contender("j3", "ann");
  Contender guest = contender("j4", "bob");
  shares.join(big.record, &big.share);
  shares.join(other.record, &other.share);
  shares.charge(big.record, &big.share, TileId{0}, 1, 36000);
  shares.charge(other.record, &other.share, TileId{0}, 1, 20000);
  shares.join(late.record, &late.share);
  EXPECT_EQ(late.share.served, 20000) << "neither behind them all nor 20,000 s ahead";
  shares.join(guest.record, &guest.share);
  EXPECT_EQ(shares.submitter_served(guest.record), 56000);
  EXPECT_EQ(guest.share.served, 0);
  shares.charge(guest.record, &guest.share, TileId{0}, 1, 10);
  EXPECT_EQ(shares.submitter_served(guest.record), 56010);
  EXPECT_EQ(shares.submitter_served(big.record), 56000);
}

TEST(FairShare, ALeaseCountsForWhatItTook) {
  FairShare shares;
  Contender job = contender("j1", "ann");
  shares.join(job.record, &job.share);
  shares.charge(job.record, &job.share, TileId{0}, 1, 2);
  shares.charge(job.record, &job.share, TileId{1}, 1, 2);
  shares.charge(job.record, &job.share, TileId{2}, 1, 2);
  EXPECT_EQ(job.share.served, 6);
  shares.settle(job.record, &job.share, TileId{0}, 1, 5);
  shares.settle(job.record, &job.share, TileId{0}, 1, 5);
  EXPECT_EQ(job.share.served, 9) << "once";
  shares.settle(job.record, &job.share, TileId{1}, 2, 5);
  EXPECT_EQ(job.share.served, 9) << "no such attempt";
  shares.settle_all(job.record, &job.share);
  EXPECT_EQ(job.share.served, 5);
  EXPECT_EQ(shares.submitter_served(job.record), 5);
}

TEST(FairShare, WhoLeavesAndReturnsKeepsWhatItOwes) {
  FairShare shares;
  Contender ann = contender("j1", "ann"), bob = contender("j2", "bob");
  shares.join(ann.record, &ann.share);
  shares.join(bob.record, &bob.share);
  shares.charge(ann.record, &ann.share, TileId{0}, 1, 50);
  shares.charge(bob.record, &bob.share, TileId{0}, 1, 10);
  shares.leave(ann.record, &ann.share);
  Contender again = contender("j3", "ann");
  shares.join(again.record, &again.share);
  EXPECT_EQ(shares.submitter_served(again.record), 50) << "a new job is no new start for its submitter";
  shares.leave(bob.record, &bob.share);
  shares.charge(again.record, &again.share, TileId{0}, 1, 100);
  shares.join(bob.record, &bob.share);
  EXPECT_EQ(shares.submitter_served(bob.record), 150) << "who was away has saved nothing up";
}

TEST(FilmAdmission, ATurnEndsForThoseWhoHaveHadMore) {
  FilmAdmission seats(100);
  const auto claim = [](int priority, double served) {
    return FilmAdmission::Claim{priority, 0, served, 40};
  };
  const JobId a{"a"}, b{"b"}, c{"c"}, urgent{"u"};
  seats.take(a, claim(0, 5), 0);
  seats.take(b, claim(0, 3), 0);
  EXPECT_FALSE(seats.may_take(c, claim(0, 1), 9)) << "their turn is not over";
  EXPECT_FALSE(seats.may_take(c, claim(0, 6), 11)) << "it has had more itself";
  ASSERT_TRUE(seats.may_take(c, claim(0, 1), 11));
  seats.take(c, claim(0, 1), 11);
  EXPECT_FALSE(seats.admitted(a)) << "the one that has had most";
  EXPECT_TRUE(seats.admitted(b) && seats.admitted(c));
  ASSERT_TRUE(seats.may_take(urgent, claim(1, 1000), 11)) << "waits for nobody's turn";
  seats.take(urgent, claim(1, 1000), 11);
  EXPECT_TRUE(seats.admitted(urgent) && seats.admitted(c));
  EXPECT_FALSE(seats.admitted(b));
  seats.leave(c);
  EXPECT_TRUE(seats.may_take(a, claim(0, 1000), 11)) << "there is room";
}

TEST(FilmAdmission, OneThatIsTooLargeIsSeatedAlone) {
  FilmAdmission seats(100);
  const JobId huge{"huge"}, small{"small"};
  ASSERT_TRUE(seats.may_take(huge, {0, 0, 0, 5000}, 0));
  seats.take(huge, {0, 0, 0, 5000}, 0);
  EXPECT_FALSE(seats.may_take(small, {0, 0, 0, 1}, 5));
  seats.update(huge, {0, 0, 7, 5000});
  ASSERT_TRUE(seats.may_take(small, {0, 0, 0, 1}, 10));
  seats.take(small, {0, 0, 0, 1}, 10);
  EXPECT_FALSE(seats.admitted(huge));
}

}  // namespace
}  // namespace lightmill
