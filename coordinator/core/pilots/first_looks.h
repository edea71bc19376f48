#pragma once
// Small pictures of jobs whose pilots run, to look at until they have samples.
#include <deque>
#include <memory>
#include <utility>

#include "common/farm/farm_types.h"
#include "common/image/image.h"

namespace lightmill {

/// Longest side of such a picture, in pixels.
inline constexpr int kMaxFirstLookSide = 256;

/// Those of the newest few jobs. Not thread-safe.
class FirstLooks {
 public:
  void put(const JobId& job, Image picture) {
    std::erase_if(newest_, [&](const auto& entry) { return entry.first == job; });
    if (newest_.size() == kMost) newest_.pop_front();
    newest_.emplace_back(job, std::make_shared<const Image>(std::move(picture)));
  }
  /// Null if there is none.
  std::shared_ptr<const Image> find(const JobId& job) const {
    for (const auto& [id, picture] : newest_) {
      if (id == job) return picture;
    }
    return nullptr;
  }

 private:
  static constexpr size_t kMost = 32;  // 24 MiB
  std::deque<std::pair<JobId, std::shared_ptr<const Image>>> newest_;
};

}  // namespace lightmill
