#pragma once
// The load guard for what is loaded before main: nothing of a program has run by then that could say what
// went wrong. A program whose main calls started() is watched from its first instruction until then.

namespace lightmill {

/// Main has begun: from here on errors are ours to report, and signals do what they did.
void started();

}  // namespace lightmill
