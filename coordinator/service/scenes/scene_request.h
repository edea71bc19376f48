#pragma once
// v1::SceneRequest and its answers as domain types, with checks of ranges.
#include "coordinator/service/scenes/scene_desk.h"
#include "lightmill/v1/thin_client.pb.h"

namespace lightmill {

/// Without the submitter. Throws Error(kUsage) for a name, a file or an option that is out of range.
SceneJob scene_job_of(const v1::SceneRequest& request);

/// What CheckScene says of an answer.
v1::CheckSceneResponse check_response(const SceneAnswer& answer);

}  // namespace lightmill
