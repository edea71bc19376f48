#pragma once
// The folder of a farm's credentials, as `lightmill-coordinator init` makes it:
//
//   DIR/ca/            ca.crt, ca.key        the authority; its key is needed only to make more
//   DIR/coordinator/   ca.crt, tls.crt, tls.key, tokens (hashes)
//   DIR/NAME/          ca.crt, tls.crt, tls.key, token       one of each for a worker, a client, ...
//
// Folders have mode 0700 and files 0600. What a program needs is one folder, to copy to its machine and to
// give as
// --credentials.
#include <optional>
#include <string>
#include <vector>

#include "coordinator/access/certificate_authority.h"
#include "coordinator/access/token_table.h"

namespace lightmill {

class CredentialFolder {
 public:
  /// `now`: seconds since 1970. Certificates and tokens are valid from an hour before, for clocks that go
  /// wrong.
  CredentialFolder(std::string path, int64_t now) : path_(std::move(path)), now_(now) {}

  /// Makes the authority and the coordinator's folder where they are missing; what is there stays, so that
  /// this can run before every start. `renew`: new certificates for the coordinator and everybody, from the
  /// same authority; tokens stay. `hosts`: names that the coordinator is reached by, besides those of this
  /// machine (with `renew`: and those of its certificate so far). Returns one line for each thing that was
  /// made. Throws Error(kFailed) if a file can't be written, Error(kUsage) for an impossible host.
  std::vector<std::string> init(const std::vector<std::string>& hosts, int days, bool renew);

  /// Makes the folder of one holder, with a new token of this role that expires after `token_days` (empty:
  /// never). Of a holder who is there already the old token ends in `grace_hours`. Throws Error(kUsage) for a
  /// bad name, Error(kFailed) without an authority.
  void grant(const std::string& name, Role role, int days, std::optional<int> token_days, double grace_hours);
  /// True if this holder has a folder.
  bool has(const std::string& name) const;
  /// Ends all tokens of a holder now and removes the folder. Throws Error(kUsage) if there is none of that
  /// name.
  void revoke(const std::string& name);

  std::string folder_of(const std::string& name) const { return path_ + "/" + name; }

 private:
  CertificateAuthority authority() const;
  void write_identity(const std::string& name, const std::vector<std::string>& hosts, int days) const;
  Validity validity(int days) const;
  std::string tokens_path() const { return path_ + "/coordinator/tokens"; }

  const std::string path_;
  const int64_t now_;
};

}  // namespace lightmill
