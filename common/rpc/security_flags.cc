#include "common/rpc/security_flags.h"

#include <CLI/CLI.hpp>

namespace lightmill {

void add_security_flags(CLI::App& app, SecurityFiles* files, Side side) {
  const bool server = side == Side::kServer;
  const char* const folder =
      server ? "Folder with ca.crt, tls.crt, tls.key and tokens (made by init): TLS and roles for all"
             : "Folder with ca.crt, tls.crt, tls.key and token, as made by lightmill-coordinator init";
  app.add_option("--credentials", files->folder, folder)->envname("LIGHTMILL_CREDENTIALS");
  app.add_option("--tls-ca", files->ca, "PEM file: certificates of this CA are accepted of the other side")
      ->envname("LIGHTMILL_TLS_CA");
  app.add_option("--tls-cert", files->cert, "PEM file: our certificate")->envname("LIGHTMILL_TLS_CERT");
  app.add_option("--tls-key", files->key, "PEM file: the private key of our certificate")
      ->envname("LIGHTMILL_TLS_KEY");
  if (server) {
    app.add_option("--tokens", files->token, "File of the accepted tokens' hashes, roles and expiry dates")
        ->envname("LIGHTMILL_TOKENS");
  } else {
    app.add_option("--token-file", files->token, "File with the token that says who we are")
        ->envname("LIGHTMILL_TOKEN_FILE");
  }
}

}  // namespace lightmill
