#include "coordinator/service/limits/quotas.h"

#include "coordinator/farm/farm_errors.h"

namespace lightmill {

void check_quotas(const Quotas& quotas, const JobRequest& job) {
  const int64_t pixels = int64_t{job.settings.grid.width} * job.settings.grid.height;
  if (pixels > quotas.max_pixels) {
    throw LimitReached("the image has " + std::to_string(pixels) + " pixels; this coordinator takes up to " +
                       std::to_string(quotas.max_pixels) + " (its --max-pixels); lower --resolution");
  }
  uint64_t left = quotas.max_bundle_bytes;
  for (const BundleEntry& entry : job.bundle.entries) {
    if (entry.size > left) {
      throw LimitReached("the scene's files are larger than the " + std::to_string(quotas.max_bundle_bytes) +
                         " bytes that this coordinator takes (its --max-bundle-mb)");
    }
    left -= entry.size;
  }
}

}  // namespace lightmill
