#pragma once
// What a program gives up before it looks at scenes, which come from strangers: the means to become somebody
// else, to start programs, to look into other processes, to be connected to, and memory without end; one that
// only reads also network and files to write.
//
//   for (const std::string& line : enter_sandbox({.memory_bytes = 4 << 30})) log(line);
#include <cstdint>
#include <exception>
#include <string>
#include <vector>

namespace lightmill {

struct SandboxOptions {
  std::string user;           // become this one (needs root); empty: stay
  uint64_t memory_bytes = 0;  // of private writable memory; 0: no limit
  bool system_calls = true;   // filter them
  bool accepts = false;       // may accept connections to sockets that listen already
  bool network = true;        // may make sockets
  bool writes = true;         // may make, change and remove files; what is open stays as it is
};

/// To be called before there are other threads, except such as serve sockets that listen: the filter and the
/// limit hold for them too. It can't be undone, and threads inherit it. Returns lines for the log: what this
/// kernel does not have, and what looks unwise. Throws Error(kUsage) if the user is unknown or can't be
/// become, Error(kFailed) if the filter can't be built.
std::vector<std::string> enter_sandbox(const SandboxOptions& options);

/// Nine tenths of what the control group or the machine has, bytes.
uint64_t usual_memory_limit();

/// What a failed tile reports: the message, or for std::bad_alloc which limit was met.
std::string failure_text(const std::exception& failure);

}  // namespace lightmill
