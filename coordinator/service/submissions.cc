#include "coordinator/service/submissions.h"

#include <chrono>

#include "coordinator/farm/farm_errors.h"

namespace lightmill {
namespace {

constexpr size_t kLargeSubmission = 64 << 10;
constexpr int kMaxWaitingSubmissions = 16;
constexpr std::chrono::seconds kSubmissionPatience(10);

}  // namespace

Bundle read_manifest(const std::string& text) {
  try {
    return bundle_from_json(text);
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, e.what());  // it came from outside: a wrong request, not a failed disk
  }
}

void require_files(BlobStore& blobs, const Bundle& bundle, std::set<std::string>* known) {
  const auto new_entry = [&](const BundleEntry& entry) {
    return !known || !known->contains(entry.digest + ":" + std::to_string(entry.size));
  };
  for (const BundleEntry& entry : bundle.entries) {
    if (!new_entry(entry) || blobs.contains(entry.digest)) continue;
    throw Error(ErrorKind::kFailed, "file " + entry.name + " of the bundle was not uploaded");
  }
  for (const BundleEntry& entry : bundle.entries) {
    if (!new_entry(entry)) continue;
    if (blobs.size(entry.digest) != entry.size) {
      if (!blobs.verify(entry.digest)) {
        throw Error(ErrorKind::kFailed,
                    "file " + entry.name + " of the bundle was damaged on the coordinator; submit it again");
      }
      throw Error(ErrorKind::kUsage, "file " + entry.name + " of the bundle has another size than it says");
    }
    if (known) known->insert(entry.digest + ":" + std::to_string(entry.size));
  }
}

SubmissionGate::Pass::Pass(SubmissionGate& gate, size_t bytes) {
  if (bytes <= kLargeSubmission) return;
  slot_.emplace(gate.waiting_, kMaxWaitingSubmissions);
  if (slot_->granted()) turn_.emplace(gate.large_, kSubmissionPatience);
  if (!turn_ || !turn_->granted())
    throw LimitReached("too many scenes of thousands of files come in at once; try again");
}

}  // namespace lightmill
