#include "worker/agent/blob_giver.h"

#include <utility>

#include "common/base/digest.h"

namespace lightmill::agent {

BlobGiver::BlobGiver(FarmLink& link, const RenderSource& source, std::function<void(const std::string&)> log)
    : link_(link), source_(source), log_(std::move(log)) {}

void BlobGiver::give(double now) {
  std::erase_if(tried_, [&](const auto& entry) { return now - entry.second >= kPauseSeconds; });
  for (const std::string& digest : link_.take_wanted_blobs()) {
    if (!is_sha256_hex(digest) || !tried_.emplace(digest, now).second) continue;
    try {
      give(digest);
    } catch (const std::exception& error) {
      log_("blob " + digest + " can't be handed in: " + error.what());
    }
  }
}

void BlobGiver::give(const std::string& digest) {
  const std::string path = source_.find_blob(digest);
  if (path.empty() || sha256_file(path) != digest) return;  // what is damaged here, too, helps nobody
  if (link_.hand_in_blob(digest, path)) log_("the coordinator had lost blob " + digest + ": handed in");
}

}  // namespace lightmill::agent
