#pragma once
// A job rendered by an embedded farm: the coordinator's core and one worker in this process.
#include <functional>
#include <memory>

#include "common/error/error_curve.h"
#include "common/image/image.h"
#include "common/scene/description.h"
#include "coordinator/core/farm.h"
#include "worker/agent/packet_renderer.h"

namespace lightmill::client {

class LiveView;

struct LocalResult {
  JobStatus status;
  Image image;
  ChannelImage aovs;  // those of the settings
  ErrorCurve curve;
  std::optional<PilotReport> pilot;  // if one ran to its end
  bool interrupted = false;
};

/// Renders `request` with `renderer`, of its scene and settings, on `threads` threads; a pilot comes first if
/// its settings need one. `observe` is called a few times a second with the newest status; once it returns
/// false, rendering stops after the tiles in hand and the result is what is there. Throws Error(kFailed) if
/// the job fails. `view`, unless null, shows the picture as it grows, and ends with it.
LocalResult render_local(const JobRequest& request, std::shared_ptr<const agent::PacketRenderer> renderer,
                         int threads, const std::function<bool(const JobStatus&)>& observe,
                         LiveView* view = nullptr);

}  // namespace lightmill::client
