#pragma once
// What secures a connection: TLS files of both sides, and the token that a client or worker sends.
//
// A folder made by `lightmill-coordinator init` holds them under fixed names; every file can be named alone,
// too. All files are read again when they change, so that certificates and tokens rotate without a restart.
#include <string>

namespace lightmill {

/// As given by flags; resolve() turns it into what is used.
struct SecurityFiles {
  std::string
      folder{};        // --credentials: ca.crt, tls.crt, tls.key, and token (clients) or tokens (coordinator)
  std::string ca{};    // --tls-ca: PEM, who may be on the other side
  std::string cert{};  // --tls-cert: PEM, who we are
  std::string key{};   // --tls-key: PEM, its private key
  std::string token{};  // --token-file: the bearer token; of a coordinator: --tokens, the table of hashes

  /// TLS is used.
  bool tls() const { return !ca.empty(); }
};

enum class Side { kClient, kServer };

/// Fills in what only the folder says and checks that the files are there, can be read and fit each other.
/// Empty stays empty: plain text. Throws Error(kUsage) with the option to mend: a part is missing, a file
/// can't be read, a key does not belong to its certificate, a token without TLS; Error(kUnreachable): our
/// certificate has expired or is not valid yet.
SecurityFiles resolve(SecurityFiles files, Side side);

/// The token in a file: its only line. Throws Error(kUsage) if the file can't be read or holds no token.
std::string read_token(const std::string& path);

}  // namespace lightmill
