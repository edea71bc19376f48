#pragma once
// What a job has made so far: its image and AOVs, where the noise is, the error curve, the pilot's report,
// and what an image file records of the job. Farm's methods of the same names say what each does.
//
// The caller must not hold FarmState::mutex, nor any layers: images are resolved with the job's layers
// locked.
#include <map>
#include <optional>
#include <string>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/farm_view.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/repair/storage_guard.h"

namespace lightmill {

class JobResults {
 public:
  JobResults(FarmState& farm, JobTable& jobs, StorageGuard& storage, const FarmView& view)
      : farm_(farm), jobs_(jobs), storage_(storage), view_(view) {}

  Image image(const JobId& id) const;
  Image display_image(const JobId& id) const;
  ChannelImage aovs(const JobId& id, Image* image, bool for_display) const;
  ChannelImage light_groups(const JobId& id, int block) const;
  Image error_map(const JobId& id) const;
  ErrorCurve curve(const JobId& id) const;
  std::optional<PilotReport> pilot(const JobId& id) const;
  std::map<std::string, std::string> image_metadata(const JobId& id) const;

 private:
  FarmState& farm_;
  JobTable& jobs_;
  StorageGuard& storage_;
  const FarmView& view_;
};

}  // namespace lightmill
