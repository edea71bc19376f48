#pragma once
// lightmill-coordinator init | grant | revoke: makes certificates and tokens, and takes them back.
#include <functional>

namespace CLI {
class App;
}

namespace lightmill {

/// Adds the commands to the program's. Parsing one of them sets `command` to what it does, which may throw
/// Error.
void add_credential_commands(CLI::App& app, std::function<void()>* command);

}  // namespace lightmill
