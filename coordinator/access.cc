#include "coordinator/access.h"

#include <algorithm>
#include <array>

namespace lightmill {
namespace {

constexpr std::array kRoles = {Role::kSubmitter, Role::kWorker, Role::kObserver, Role::kAdmin};

constexpr unsigned bit(Role role) { return 1u << static_cast<int>(role); }
constexpr unsigned kLook = bit(Role::kObserver) | bit(Role::kSubmitter) | bit(Role::kAdmin);
constexpr unsigned kChange = bit(Role::kSubmitter) | bit(Role::kAdmin);
constexpr unsigned kWork = bit(Role::kWorker);

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
      {"/lightmill.v1.ClientService/SubmitJob", kChange},
      {"/lightmill.v1.ClientService/PauseJob", kChange},
      {"/lightmill.v1.ClientService/ResumeJob", kChange},
      {"/lightmill.v1.ClientService/CancelJob", kChange},
      {"/lightmill.v1.ClientService/RetryJob", kChange},
      {"/lightmill.v1.ClientService/ExtendJob", kChange},
      {"/lightmill.v1.ClientService/FindMissingBlobs", kChange},
      {"/lightmill.v1.ClientService/UploadBlobs", kChange},
      {"/lightmill.v1.WorkerService/Register", kWork},
      {"/lightmill.v1.WorkerService/Lease", kWork},
      {"/lightmill.v1.WorkerService/Renew", kWork},
      {"/lightmill.v1.WorkerService/Commit", kWork},
      {"/lightmill.v1.WorkerService/Fail", kWork},
      {"/lightmill.v1.WorkerService/Drain", kWork},
      {"/lightmill.v1.WorkerService/GetBundle", kWork},
      {"/lightmill.v1.WorkerService/FetchBlobs", kWork},
      {"/grpc.health.v1.Health/Check", 0, true},  // probes have a certificate, and no secret to learn
      {"/grpc.health.v1.Health/Watch", kLook | kWork},
      {"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", kLook | kWork},
      {"/healthz", 0, true},
      {"/metrics", kLook},
      {"/", kLook},
  };
  return rules;
}

const AccessRule* access_rule(std::string_view path) {
  const std::vector<AccessRule>& rules = access_rules();
  const auto found =
      std::find_if(rules.begin(), rules.end(), [&](const AccessRule& r) { return r.path == path; });
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
