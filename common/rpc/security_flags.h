#pragma once
// --credentials, --tls-ca, --tls-cert, --tls-key and the token's option, for a program's command line.
#include "common/rpc/security.h"

namespace CLI {
class App;
}

namespace lightmill {

/// Adds the options, each also as LIGHTMILL_... in the environment. `files` is to be resolved after parsing.
void add_security_flags(CLI::App& app, SecurityFiles* files, Side side);

}  // namespace lightmill
