#pragma once
// Who may do what: one table of every RPC and every HTTP route with the roles that may use it.
//
// What is not in the table is refused to everybody. tests/coordinator/access/access_test.cc compares it with
// the services' descriptors, so that a new RPC without a line here fails the tests.
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

enum class Role { kSubmitter, kWorker, kObserver, kAdmin };
/// "submitter", "worker", "observer" or "admin".
const char* role_name(Role role);
/// Inverse; empty for any other text.
std::optional<Role> role_from_name(std::string_view name);

struct AccessRule {
  /// "/package.Service/Method", or an HTTP route such as "/metrics" or "/api/v1/jobs/*/curve", where "*" is
  /// one segment of any name.
  std::string_view path;
  unsigned roles = 0;      // bit 1 << Role
  bool everybody = false;  // no token is needed
};
/// The whole table.
const std::vector<AccessRule>& access_rules();
/// The rule of a path; empty if there is none.
const AccessRule* access_rule(std::string_view path);
inline bool may(const AccessRule& rule, Role role) { return rule.roles >> static_cast<int>(role) & 1; }
/// "submitter or admin", for messages.
std::string roles_text(const AccessRule& rule);

}  // namespace lightmill
