#include "client/connection/in_process_link.h"

#include "common/base/error.h"

namespace lightmill::client {
void InProcessLink::throw_if_cancelled() const {
  if (cancelled_) throw agent::LinkDown("the render is stopping");
}

void InProcessLink::register_worker(const WorkerRegistration& registration) {
  worker_ = farm_.register_worker(registration);
}

std::optional<LeaseGrant> InProcessLink::lease(double wait_seconds) {
  throw_if_cancelled();
  return farm_.lease(worker_, wait_seconds);
}

std::vector<LeaseKey> InProcessLink::renew(const std::vector<LeaseKey>& held) {
  throw_if_cancelled();
  return farm_.renew(worker_, held);
}

agent::CommitAnswer InProcessLink::commit(const LeaseKey& key, const std::string& partial_bytes) {
  throw_if_cancelled();
  return {farm_.commit(worker_, key, partial_bytes), ""};
}

void InProcessLink::hand_back(const LeaseKey& key, agent::HandBack /*why*/) {
  throw_if_cancelled();
  farm_.hand_back(worker_, key);
}

void InProcessLink::fail(const LeaseKey& key, const std::string& reason, FailureKind kind) {
  throw_if_cancelled();
  farm_.fail(worker_, key, reason, kind);
}

void InProcessLink::warn(const LeaseKey& key, const std::vector<std::string>& missing_light) {
  throw_if_cancelled();
  farm_.warn(worker_, key, missing_light);
}

void InProcessLink::show(const LeaseKey& key, const Image& picture) {
  throw_if_cancelled();
  farm_.show(worker_, key, picture);
}

void InProcessLink::drain() { farm_.drain(worker_); }

Bundle InProcessLink::bundle(const std::string& digest) { return farm_.bundle(digest); }

void InProcessLink::fetch_blobs(const std::vector<std::string>&, agent::BlobSink&) {
  throw std::logic_error("the embedded farm has no blobs to send");
}

}  // namespace lightmill::client
