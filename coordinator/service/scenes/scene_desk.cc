#include "coordinator/service/scenes/scene_desk.h"

#include "coordinator/service/limits/in_flight_limit.h"

namespace lightmill {

SceneAnswer SceneDesk::check(const SceneQuestion& question) {
  const Slot slot(reading_, kMaxReading);
  if (!slot.granted()) throw LimitReached("other scenes are being read; try again in a moment");
  JobRequest bounded;  // nothing is read that could not be submitted
  bounded.bundle = question.files;
  check_quotas(quotas_, bounded);
  SceneQuestion asked = question;
  for (const BundleEntry& entry : question.files.entries) {
    if (!blobs_.contains(entry.digest))
      throw Error(ErrorKind::kFailed, "file " + entry.name + " was not uploaded");
    if (blobs_.size(entry.digest) != entry.size)
      throw Error(ErrorKind::kUsage, "file " + entry.name + " has another size than it says");
    asked.paths.push_back(blobs_.path(entry.digest));
  }
  if (!read_scene_)
    throw Error(ErrorKind::kFailed, "this coordinator reads no scenes; submit it by lightmill submit");
  return read_scene_(asked);
}

SceneDesk::Submitted SceneDesk::submit(const SceneJob& scene, const std::function<std::string()>& refusal) {
  const SceneAnswer answer = check(scene.question);
  if (!answer.errors.empty()) {
    const size_t more = answer.errors.size() - 1;
    throw Error(ErrorKind::kBadScene,
                answer.errors.front() + (more > 0 ? " (and " + std::to_string(more) + " more)" : ""));
  }
  JobRequest job = scene.job;
  job.bundle = answer.bundle;
  job.settings = answer.settings;
  check_quotas(quotas_, job);
  if (const std::string why = refusal(); !why.empty()) throw LimitReached(why);
  return {farm_.submit(job), answer.warnings};
}

}  // namespace lightmill
