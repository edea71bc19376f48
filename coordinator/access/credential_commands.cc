#include "coordinator/access/credential_commands.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <memory>

#include "coordinator/access/credential_folder.h"

namespace lightmill {
namespace {

struct Options {
  std::string folder = "lightmill-credentials";
  std::vector<std::string> hosts;
  int days = 397;
  bool renew = false;
  std::string name, role = "submitter";
  int token_days = 0;
  double grace_hours = 24;
};

constexpr struct {
  const char* name;
  Role role;
} kHolders[] = {{"worker", Role::kWorker},
                {"client", Role::kSubmitter},
                {"observer", Role::kObserver},
                {"admin", Role::kAdmin}};

void add_common(CLI::App* command, Options* o) {
  command->add_option("--dir", o->folder, "The folder of the farm's credentials")
      ->envname("LIGHTMILL_CREDENTIALS_DIR")
      ->capture_default_str();
}

void add_days(CLI::App* command, Options* o) {
  command->add_option("--days", o->days, "How long new certificates are valid")
      ->check(CLI::Range(1, 3650).description("1 to 3650"))
      ->capture_default_str();
}

void init(const Options& o) {
  CredentialFolder folder(o.folder, std::time(nullptr));
  std::vector<std::string> made = folder.init(o.hosts, o.days, o.renew);
  for (const auto& holder : kHolders) {
    if (folder.has(holder.name)) continue;
    folder.grant(holder.name, holder.role, o.days, std::nullopt, 0);
    made.push_back(folder.folder_of(holder.name) + ": certificate and token of the role " +
                   role_name(holder.role));
  }
  for (const std::string& line : made) std::printf("%s\n", line.c_str());
  if (made.empty()) std::printf("%s: everything is there already\n", o.folder.c_str());
  std::printf("Keep %s/ca to yourself. Each of the others goes to a program's --credentials.\n",
              o.folder.c_str());
}

void grant(const Options& o) {
  CredentialFolder folder(o.folder, std::time(nullptr));
  const std::optional<int> token_days = o.token_days > 0 ? std::optional(o.token_days) : std::nullopt;
  folder.grant(o.name, *role_from_name(o.role), o.days, token_days, o.grace_hours);
  std::printf("%s: certificate and token of the role %s\n", folder.folder_of(o.name).c_str(), o.role.c_str());
}

void revoke(const Options& o) {
  CredentialFolder(o.folder, std::time(nullptr)).revoke(o.name);
  std::printf("%s: its tokens are void from now on\n", o.name.c_str());
}

}  // namespace

void add_credential_commands(CLI::App& app, std::function<void()>* command) {
  const auto options = std::make_shared<Options>();
  Options* const o = options.get();

  CLI::App* const make = app.add_subcommand(
      "init", "Make a certificate authority, certificates and tokens; keeps what is there already");
  add_common(make, o);
  add_days(make, o);
  make->add_option("--san", o->hosts, "A host name or address that the coordinator is reached by (repeat it)")
      ->envname("LIGHTMILL_SAN")
      ->delimiter(',');
  make->add_flag("--renew", o->renew, "New certificates for all, from the same authority; tokens stay");
  make->callback([=] { *command = [options] { init(*options); }; });

  CLI::App* const give =
      app.add_subcommand("grant", "Make a certificate and a token for somebody, or new ones");
  give->add_option("NAME", o->name, "Of the person or machine; also the folder's name")->required();
  give->add_option("--role", o->role, "submitter, worker, observer or admin")
      ->check(CLI::IsMember({"submitter", "worker", "observer", "admin"}))
      ->capture_default_str();
  add_common(give, o);
  add_days(give, o);
  give->add_option("--token-days", o->token_days, "How long the token is valid; 0: until it is revoked")
      ->check(CLI::Range(0, 36500).description("0 to 36500"))
      ->capture_default_str();
  give->add_option("--grace-hours", o->grace_hours, "How long a token that this one replaces goes on")
      ->check(CLI::Range(0.0, 1e6).description("0 to 1000000"))
      ->capture_default_str();
  give->callback([=] { *command = [options] { grant(*options); }; });

  CLI::App* const take = app.add_subcommand("revoke", "Void somebody's tokens at once, without a restart");
  take->add_option("NAME", o->name, "As given to grant")->required();
  add_common(take, o);
  take->callback([=] { *command = [options] { revoke(*options); }; });
}

}  // namespace lightmill
