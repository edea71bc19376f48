#pragma once
// The worker's view of the farm: the seam between "lease, render, commit" and what carries it.
//
// GrpcLink dials a coordinator; the client's InProcessLink calls the coordinator's core directly; tests
// script one. Every call may throw
//   LinkDown       the other side can't be reached now: try again with backoff; all calls may be repeated
//   Damaged        bytes changed on their way: try again a few times
//   NotRegistered  it has forgotten this worker (it was restarted): register again
//   MissingBlob    it has lost a file of the scene: hand the tile back
//   Error          it refuses for good (register_worker: another build) or has no such thing (bundle).
// All calls but register_worker are thread-safe with each other.
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/farm/farm_types.h"
#include "common/image/image.h"
#include "common/scene/bundle.h"

namespace lightmill::agent {

struct LinkDown : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct NotRegistered : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The coordinator has lost a file of the scene. Another worker may have it, or a client send it again.
struct MissingBlob : Error {
  explicit MissingBlob(const std::string& message) : Error(ErrorKind::kFailed, message) {}
};

/// A digest does not fit what arrived, here or there.
struct Damaged : Error {
  explicit Damaged(const std::string& message) : Error(ErrorKind::kFailed, message) {}
};

/// Why a tile is handed back, of which nobody is to blame.
enum class HandBack { kNoTime, kMissingBlob };

inline LeaseKey key_of(const LeaseGrant& lease) { return {lease.job, lease.tile_id, lease.attempt}; }

struct CommitAnswer {
  CommitResult outcome = CommitResult::kAccepted;
  std::string message;  // why it was refused
};

/// Receives blobs in the order asked: begin, any number of writes, end.
class BlobSink {
 public:
  virtual ~BlobSink() = default;
  virtual void begin(const std::string& digest, uint64_t size) = 0;
  virtual void write(std::string_view chunk) = 0;
  virtual void end() = 0;
};

class FarmLink {
 public:
  virtual ~FarmLink() = default;
  virtual void register_worker(const WorkerRegistration& registration) = 0;
  /// The next tile, waiting up to `wait_seconds` for one.
  virtual std::optional<LeaseGrant> lease(double wait_seconds) = 0;
  /// Keeps leases alive; returns those that are lost.
  virtual std::vector<LeaseKey> renew(const std::vector<LeaseKey>& held) = 0;
  virtual CommitAnswer commit(const LeaseKey& key, const std::string& partial_bytes) = 0;
  /// The tile can't be rendered here; `reason` is one line.
  virtual void fail(const LeaseKey& key, const std::string& reason, FailureKind kind) = 0;
  /// What light the image of the lease's job will lack, lines for people: at least one.
  virtual void warn(const LeaseKey& key, const std::vector<std::string>& missing_light) = 0;
  /// A small picture of the job whose pilot this is, to look at until there are samples.
  virtual void show(const LeaseKey& key, const Image& picture) { (void)key, (void)picture; }
  /// Another worker may have the tile at once or, for lack of a file, once that is back.
  virtual void hand_back(const LeaseKey& key, HandBack why) = 0;
  /// No more leases, please.
  virtual void drain() = 0;
  virtual Bundle bundle(const std::string& digest) = 0;
  /// Throws MissingBlob if the coordinator lacks one.
  virtual void fetch_blobs(const std::vector<std::string>& digests, BlobSink& sink) = 0;
  /// Blobs that the coordinator has lost, of its newest answer to lease() or renew(); each answer is told
  /// once.
  virtual std::vector<std::string> take_wanted_blobs() { return {}; }
  /// Hands in the blob, which is in this file. False if it is not wanted, or somebody else brings it.
  virtual bool hand_in_blob(const std::string& digest, const std::string& path) {
    (void)digest, (void)path;
    return false;
  }
  /// Makes calls in progress, and later ones, throw LinkDown soon. Any thread.
  virtual void cancel() = 0;
};

}  // namespace lightmill::agent
