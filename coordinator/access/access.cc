#include "coordinator/access/access.h"

#include <algorithm>
#include <array>

namespace lightmill {
namespace {

constexpr std::array kRoles = {Role::kSubmitter, Role::kWorker, Role::kObserver, Role::kAdmin};

constexpr unsigned bit(Role role) { return 1u << static_cast<int>(role); }
constexpr unsigned kLook = bit(Role::kObserver) | bit(Role::kSubmitter) | bit(Role::kAdmin);
constexpr unsigned kChange = bit(Role::kSubmitter) | bit(Role::kAdmin);
constexpr unsigned kWork = bit(Role::kWorker);

/// Whether a path is one of the rule's: "*" stands for one segment that is not empty.
bool matches(std::string_view rule, std::string_view path) {
  const size_t star = rule.find('*');
  if (star == std::string_view::npos) return rule == path;
  if (path.substr(0, star) != rule.substr(0, star)) return false;
  const std::string_view rest = path.substr(star);
  const size_t segment = std::min(rest.find('/'), rest.size());
  return segment > 0 && rest.substr(segment) == rule.substr(star + 1);
}

}  // namespace

const char* role_name(Role role) {
  switch (role) {
    case Role::kSubmitter:
      return "submitter";
    case Role::kWorker:
      return "worker";
    case Role::kObserver:
      return "observer";
    case Role::kAdmin:
      return "admin";
  }
  return "?";
}

std::optional<Role> role_from_name(std::string_view name) {
  for (const Role role : kRoles) {
    if (name == role_name(role)) return role;
  }
  return std::nullopt;
}

const std::vector<AccessRule>& access_rules() {
  static const std::vector<AccessRule> rules = {
      {"/lightmill.v1.ClientService/GetJob", kLook},
      {"/lightmill.v1.ClientService/ListJobs", kLook},
      {"/lightmill.v1.ClientService/ListTiles", kLook},
      {"/lightmill.v1.ClientService/ListWorkers", kLook},
      {"/lightmill.v1.ClientService/WatchJob", kLook},
      {"/lightmill.v1.ClientService/FetchImage", kLook},
      {"/lightmill.v1.ClientService/GetCurve", kLook},
      {"/lightmill.v1.ClientService/GetLogs", kLook},
      {"/lightmill.v1.ClientService/SubmitJob", kChange},
      {"/lightmill.v1.ClientService/PauseJob", kChange},
      {"/lightmill.v1.ClientService/ResumeJob", kChange},
      {"/lightmill.v1.ClientService/CancelJob", kChange},
      {"/lightmill.v1.ClientService/RetryJob", kChange},
      {"/lightmill.v1.ClientService/ExtendJob", kChange},
      {"/lightmill.v1.ClientService/SetJobPriority", kChange},
      {"/lightmill.v1.ClientService/FindMissingBlobs", kChange},
      {"/lightmill.v1.ClientService/UploadBlobs", kChange},
      {"/lightmill.v1.SequenceService/GetSequence", kLook},
      {"/lightmill.v1.SequenceService/ListSequences", kLook},
      {"/lightmill.v1.SequenceService/ListFrames", kLook},
      {"/lightmill.v1.SequenceService/WatchSequence", kLook},
      {"/lightmill.v1.SequenceService/SubmitSequence", kChange},
      {"/lightmill.v1.SequenceService/AddFrames", kChange},
      {"/lightmill.v1.SequenceService/PauseSequence", kChange},
      {"/lightmill.v1.SequenceService/ResumeSequence", kChange},
      {"/lightmill.v1.SequenceService/CancelSequence", kChange},
      {"/lightmill.v1.SequenceService/RetrySequence", kChange},
      {"/lightmill.v1.SequenceService/ExtendSequence", kChange},
      {"/lightmill.v1.SequenceService/SetSequencePriority", kChange},
      {"/lightmill.v1.ThinClientService/GetPicture", kLook},
      {"/lightmill.v1.ThinClientService/PutBlob", kChange},
      {"/lightmill.v1.ThinClientService/CheckScene", kChange},
      {"/lightmill.v1.ThinClientService/SubmitScene", kChange},
      {"/lightmill.v1.WorkerService/Register", kWork},
      {"/lightmill.v1.WorkerService/Lease", kWork},
      {"/lightmill.v1.WorkerService/Renew", kWork},
      {"/lightmill.v1.WorkerService/Commit", kWork},
      {"/lightmill.v1.WorkerService/Fail", kWork},
      {"/lightmill.v1.WorkerService/Warn", kWork},
      {"/lightmill.v1.WorkerService/ShowPicture", kWork},
      {"/lightmill.v1.WorkerService/Drain", kWork},
      {"/lightmill.v1.WorkerService/GetBundle", kWork},
      {"/lightmill.v1.WorkerService/FetchBlobs", kWork},
      {"/lightmill.v1.WorkerService/HandInBlob", kWork},
      {"/grpc.health.v1.Health/Check", 0, true},  // probes have a certificate, and no secret to learn
      {"/grpc.health.v1.Health/Watch", kLook | kWork},
      {"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", kLook | kWork},
      {"/healthz", 0, true},
      {"/livez", 0, true},
      {"/metrics", kLook},
      // Other paths below /v1 are RPCs, and have their roles (coordinator/http_api).
      {"/v1/openapi.json", kLook},
      {"/", kLook},
      {"/assets/*", kLook},
      {"/api/v1/session", kLook},
      {"/api/v1/events", kLook},
      {"/api/v1/jobs", kLook},
      {"/api/v1/jobs/*", kLook},
      {"/api/v1/jobs/*/curve", kLook},
      {"/api/v1/jobs/*/tiles", kLook},
      {"/api/v1/jobs/*/log", kLook},
      {"/api/v1/jobs/*/thumbnail", kLook},
      {"/api/v1/jobs/*/image", kLook},
      {"/api/v1/jobs/*/denoised", kLook},
      {"/api/v1/jobs/*/light-mix", kLook},
      {"/api/v1/jobs/*/image.png", kLook},
      {"/api/v1/jobs/*/image.exr", kLook},
      {"/api/v1/jobs/*/error-map", kLook},
      {"/api/v1/workers", kLook},
      {"/api/v1/workers/timeline", kLook},
      {"/api/v1/log", kLook},
      {"/api/v1/jobs/*/pause", kChange},
      {"/api/v1/jobs/*/resume", kChange},
      {"/api/v1/jobs/*/cancel", kChange},
      {"/api/v1/jobs/*/retry", kChange},
      {"/api/v1/jobs/*/extend", kChange},
      {"/api/v1/jobs/*/priority", kChange},
      {"/api/v1/jobs/*/resubmit", kChange},
      {"/api/v1/sequences", kLook},
      {"/api/v1/sequences/*", kLook},
      {"/api/v1/sequences/*/frames", kLook},
      {"/api/v1/sequences/*/pause", kChange},
      {"/api/v1/sequences/*/resume", kChange},
      {"/api/v1/sequences/*/cancel", kChange},
      {"/api/v1/sequences/*/retry", kChange},
      {"/api/v1/sequences/*/extend", kChange},
      {"/api/v1/sequences/*/priority", kChange},
      {"/api/v1/blobs/*", kChange},
      {"/api/v1/scene/check", kChange},
      {"/api/v1/scene/submit", kChange},
  };
  return rules;
}

const AccessRule* access_rule(std::string_view path) {
  const std::vector<AccessRule>& rules = access_rules();
  const auto found =
      std::find_if(rules.begin(), rules.end(), [&](const AccessRule& r) { return matches(r.path, path); });
  return found == rules.end() ? nullptr : &*found;
}

std::string roles_text(const AccessRule& rule) {
  std::vector<std::string> names;
  for (const Role role : kRoles) {
    if (may(rule, role)) names.emplace_back(role_name(role));
  }
  std::string text;
  for (size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " or " : ", ";
    text += names[i];
  }
  return text;
}

}  // namespace lightmill
