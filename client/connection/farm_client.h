#pragma once
// The client service of a coordinator, in domain types.
//
// Every call has a deadline and throws Error: kUnreachable with the address if nobody answers, kFailed for an
// unknown job or a request that does not fit the job's state, kUsage for values out of range.
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/options.h"
#include "common/error/error_curve.h"
#include "common/image/image.h"
#include "coordinator/core/farm.h"

namespace lightmill::client {

struct FetchedImage {
  Image image;
  ChannelImage aovs;  // without channels if they were not asked for, or the job has none
  std::map<std::string, std::string> metadata;
};

/// See LogLine in proto/lightmill/v1/client.proto.
struct TileLogLine {
  double time = 0;
  int64_t tile = -1, attempt = 0;
  std::string worker, text;
};

class FarmConnection;  // farm_connection.h

using UploadProgress = std::function<void(size_t blobs, uint64_t sent, uint64_t bytes)>;

class FarmClient {
 public:
  /// Does not connect yet. Throws Error(kUsage) for a malformed address, one that plain text is not allowed
  /// to, or bad files of TLS and token (see resolve() in common/rpc/security.h).
  explicit FarmClient(const ConnectionOptions& connection);
  ~FarmClient();

  /// Uploads the blobs (digest -> path) that the coordinator lacks, then queues the job. `uploading` is told
  /// how many blobs and bytes are sent, at the start, with 0 bytes sent, and as they go; not at all if none
  /// are.
  JobId submit(const JobRequest& request, const std::map<std::string, std::string>& blob_paths,
               const UploadProgress& uploading);
  JobStatus job(const JobId& id);
  /// What the job's pilot estimated and chose; empty if it had none, or none yet.
  std::optional<PilotReport> pilot(const JobId& id);
  /// With `frames` also those of sequences.
  std::vector<JobStatus> jobs(bool frames = false);
  std::vector<TileStatus> tiles(const JobId& id);
  /// The newest `most` (at most 20000) lines about the job, or one of its tiles, oldest first.
  std::vector<TileLogLine> logs(const JobId& id, const std::optional<int64_t>& tile, int64_t most);
  std::vector<WorkerStatus> workers();
  JobStatus pause(const JobId& id);
  JobStatus resume(const JobId& id);
  JobStatus cancel(const JobId& id);
  JobStatus retry(const JobId& id);
  JobStatus extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
                   std::optional<double> target_error);
  JobStatus set_priority(const JobId& id, int priority);
  /// Calls `observe` with every status until the job is done, failed or cancelled; returns the last one. A
  /// coordinator that restarts meanwhile is waited for, up to a minute; `lost` is told once per loss.
  JobStatus watch(const JobId& id, const std::function<void(const JobStatus&)>& observe,
                  const std::function<void(const std::string&)>& lost);
  /// `max_side` over 0: a preview, whose longer side has at most so many pixels.
  /// `for_display`: pixels that no sample has reached yet take the mean of those around them; without AOVs.
  FetchedImage fetch(const JobId& id, bool with_aovs = false, int max_side = 0, bool for_display = false);
  ErrorCurve curve(const JobId& id);

 private:
  std::unique_ptr<FarmConnection> farm_;
};

}  // namespace lightmill::client
