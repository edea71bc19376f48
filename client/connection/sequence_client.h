#pragma once
// The sequence service of a coordinator, in domain types. Errors are those of FarmClient (farm_client.h).
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/connection/farm_client.h"
#include "client/options.h"
#include "common/farm/sequence_types.h"

namespace lightmill::client {

/// Sends those files of the bundles (digest -> path) that the coordinator lacks; `uploading` as in
/// FarmClient::submit.
void upload_files(FarmConnection& farm, const std::vector<Bundle>& bundles,
                  const std::map<std::string, std::string>& paths, const UploadProgress& uploading);

class SequenceClient {
 public:
  explicit SequenceClient(const ConnectionOptions& connection);
  ~SequenceClient();

  /// Uploads what is missing, then queues the sequence and adds its frames, in calls of a size that messages
  /// take.
  SequenceId submit(const SequenceRequest& request, const std::vector<FrameRequest>& frames,
                    const std::map<std::string, std::string>& blob_paths, const UploadProgress& uploading);
  SequenceStatus sequence(const SequenceId& id);
  std::vector<SequenceStatus> sequences();
  /// Those that changed after `since`.
  std::vector<FrameStatus> frames(const SequenceId& id, uint64_t since = 0);
  SequenceStatus pause(const SequenceId& id);
  SequenceStatus resume(const SequenceId& id);
  SequenceStatus cancel(const SequenceId& id);
  SequenceStatus retry(const SequenceId& id);
  SequenceStatus extend(const SequenceId& id, std::optional<int64_t> spp, std::optional<double> time_s,
                        std::optional<double> target_error);
  SequenceStatus set_priority(const SequenceId& id, int priority);
  /// As FarmClient::watch.
  SequenceStatus watch(const SequenceId& id, const std::function<void(const SequenceStatus&)>& observe,
                       const std::function<void(const std::string&)>& lost);

 private:
  std::unique_ptr<FarmConnection> farm_;
};

}  // namespace lightmill::client
