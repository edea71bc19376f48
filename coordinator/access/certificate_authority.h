#pragma once
// A small certificate authority: EC keys on P-256, certificates signed with SHA-256.
//
//   const CertificateAuthority ca = CertificateAuthority::create("Lightmill farm", {now, now + 10 * kYear});
//   const PemPair server = ca.issue("coordinator", {"localhost", "127.0.0.1"}, {now, now + kYear});
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace lightmill {

/// Seconds since 1970, UTC.
struct Validity {
  int64_t from = 0, until = 0;
};

struct PemPair {
  std::string certificate, key;
};

class CertificateAuthority {
 public:
  static CertificateAuthority create(const std::string& name, const Validity& validity);
  /// From its PEM texts; throws Error(kFailed) if these are no certificate and its key.
  explicit CertificateAuthority(const PemPair& pem);
  ~CertificateAuthority();
  CertificateAuthority(CertificateAuthority&&) noexcept;
  CertificateAuthority& operator=(CertificateAuthority&&) noexcept;

  const PemPair& pem() const;
  /// A certificate for a program, with a new key. With `hosts` (DNS names and IP addresses) it is a server's,
  /// without a client's. Throws Error(kUsage) for a host that is neither.
  PemPair issue(const std::string& name, const std::vector<std::string>& hosts,
                const Validity& validity) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
