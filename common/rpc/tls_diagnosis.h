#pragma once
// Says in a sentence why a TLS connection fails: gRPC itself only says that the handshake did.
#include <string>

#include "common/rpc/security.h"

namespace lightmill {

struct TlsDiagnosis {
  std::string problem;  // "its certificate expired on ...": one line for the user; empty: the handshake works
  bool definite = false;  // trying again will not help until somebody mends it; clocks and networks may
};

/// Tries a handshake of its own with HOST:PORT, within about three seconds. `files`: resolved; without TLS it
/// only finds out whether the other side insists on it. Nobody listening is no problem of TLS: empty.
TlsDiagnosis diagnose_tls(const std::string& address, const SecurityFiles& files);

}  // namespace lightmill
