#include "coordinator/store/blob_scrub.h"

#include <algorithm>
#include <utility>

#include "common/base/error.h"

namespace lightmill {

BlobScrub::BlobScrub(BlobStore& blobs, double bytes_per_second, std::function<void(const std::string&)> log)
    : blobs_(blobs), bytes_per_second_(bytes_per_second), log_(std::move(log)) {}

double BlobScrub::step(double now) {
  if (!in_pass_) {
    left_ = blobs_.digests();
    std::reverse(left_.begin(), left_.end());
    pass_begun_ = now;
    in_pass_ = true;
  }
  if (!open_ && left_.empty()) {
    in_pass_ = false;
    return std::max(0.0, pass_begun_ + kPassSeconds - now);
  }
  try {
    return static_cast<double>(read()) / bytes_per_second_;
  } catch (const Error& error) {  // not now: the next pass tries again
    open_.reset();
    if (log_) log_(error.what());
    return static_cast<double>(kStepBytes) / bytes_per_second_;
  }
}

size_t BlobScrub::read() {
  if (!open_) {
    const std::string digest = std::move(left_.back());
    left_.pop_back();
    open_ = blobs_.open(digest);
    if (!open_) return 0;  // gone meanwhile
    open_->read_from_disk();
  }
  const size_t bytes = open_->next(kStepBytes).size();
  if (bytes > 0) return bytes;
  open_->finish();
  open_.reset();
  return 0;
}

}  // namespace lightmill
