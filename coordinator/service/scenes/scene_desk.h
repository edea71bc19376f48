#pragma once
// Scenes that were uploaded file by file: what they still lack, and the jobs that they become. The
// dashboard's JSON (coordinator/web/scene_submit.h) and the RPCs of v1::ThinClientService come here.
#include <atomic>
#include <functional>

#include "coordinator/core/farm.h"
#include "coordinator/scene/scene_reader.h"
#include "coordinator/service/limits/quotas.h"
#include "coordinator/store/blob_store.h"

namespace lightmill {

/// A scene, and what does not concern how it is read. Bundle and settings of `job` are those of the answer.
struct SceneJob {
  SceneQuestion question;  // without `paths`
  JobRequest job;
};

/// Thread-safe.
class SceneDesk {
 public:
  using ReadScene = std::function<SceneAnswer(const SceneQuestion&)>;
  /// Scenes that are read at once, of all callers together.
  static constexpr int kMaxReading = 2;

  /// References must outlive this. `read_scene`: as the function of that name; empty: no scenes are read
  /// here.
  SceneDesk(Farm& farm, BlobStore& blobs, const Quotas& quotas, ReadScene read_scene)
      : farm_(farm), blobs_(blobs), quotas_(quotas), read_scene_(std::move(read_scene)) {}

  /// What is wrong with it and what it lacks. Throws LimitReached for quotas, or while others are read;
  /// Error(kFailed) for a file that was not uploaded, Error(kUsage) for one of another size than it says, and
  /// what `read_scene` throws.
  SceneAnswer check(const SceneQuestion& question);

  struct Submitted {
    JobId job;
    std::vector<std::string> warnings;  // of the scene
  };
  /// Queues the job. `refusal` is asked last, and says why the caller may submit nothing now, or nothing.
  /// Throws as check, Error(kBadScene) with the scene's first error, and what Farm::submit throws.
  Submitted submit(const SceneJob& scene, const std::function<std::string()>& refusal);

 private:
  Farm& farm_;
  BlobStore& blobs_;
  const Quotas quotas_;
  const ReadScene read_scene_;
  std::atomic<int> reading_{0};
};

}  // namespace lightmill
