#include "client/in_process_link.h"

#include "common/error.h"

namespace lightmill::client {
namespace {

Farm::LeaseKey to_farm(const agent::LeaseKey& key) { return {JobId{key.job}, TileId{key.tile}, key.attempt}; }
agent::LeaseKey from_farm(const Farm::LeaseKey& key) { return {key.job.value, key.tile.value, key.attempt}; }

agent::CommitOutcome from_farm(CommitResult result) {
  switch (result) {
    case CommitResult::kAccepted:
      return agent::CommitOutcome::kAccepted;
    case CommitResult::kAlreadyCommitted:
      return agent::CommitOutcome::kAlreadyCommitted;
    case CommitResult::kStale:
      return agent::CommitOutcome::kStale;
    case CommitResult::kCorrupt:
      return agent::CommitOutcome::kCorrupt;
    case CommitResult::kUnknownJob:
      return agent::CommitOutcome::kUnknownJob;
  }
  throw std::logic_error("unknown commit result");
}

}  // namespace

void InProcessLink::throw_if_cancelled() const {
  if (cancelled_) throw agent::LinkDown("the render is stopping");
}

void InProcessLink::register_worker(const agent::Registration& r) {
  worker_ = farm_.register_worker({r.host, r.threads, r.build, r.schema, r.arithmetic_class, r.pool});
}

std::optional<agent::Lease> InProcessLink::lease(double wait_seconds) {
  throw_if_cancelled();
  const std::optional<LeaseGrant> grant = farm_.lease(worker_, wait_seconds);
  if (!grant) return std::nullopt;
  return agent::Lease{{grant->job.value, grant->tile_id.value, grant->attempt},
                      grant->tile,
                      settings_to_json(grant->settings),
                      grant->bundle_digest,
                      grant->lease_seconds};
}

std::vector<agent::LeaseKey> InProcessLink::renew(const std::vector<agent::LeaseKey>& held) {
  throw_if_cancelled();
  std::vector<Farm::LeaseKey> keys;
  for (const agent::LeaseKey& key : held) keys.push_back(to_farm(key));
  std::vector<agent::LeaseKey> lost;
  for (const Farm::LeaseKey& key : farm_.renew(worker_, keys)) lost.push_back(from_farm(key));
  return lost;
}

agent::CommitAnswer InProcessLink::commit(const agent::LeaseKey& key, const std::string& partial_bytes) {
  throw_if_cancelled();
  return {from_farm(farm_.commit(worker_, to_farm(key), partial_bytes)), ""};
}

void InProcessLink::fail(const agent::LeaseKey& key, const std::string& reason) {
  throw_if_cancelled();
  farm_.fail(worker_, to_farm(key), reason);
}

void InProcessLink::drain() { farm_.drain(worker_); }

Bundle InProcessLink::bundle(const std::string& digest) { return farm_.bundle(digest); }

void InProcessLink::fetch_blobs(const std::vector<std::string>&, agent::BlobSink&) {
  throw std::logic_error("the embedded farm has no blobs to send");
}

}  // namespace lightmill::client
