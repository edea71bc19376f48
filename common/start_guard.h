#pragma once
// A line instead of a bare signal where a program dies before its main begins.
//
// OpenImageIO and the three hundred libraries behind it start threads and take memory while they are loaded.
// Where a limit of the system is in their way (ulimit -d, -v, -u, or a container's), they throw, abort or
// crash, and nothing of ours has run that could say so. A program whose main calls started() is watched from
// its first instruction until then: such an end prints one line to stderr, and the exit code is 1.

namespace lightmill {

/// Main has begun: from here on errors are ours to report, and signals do what they did.
void started();

}  // namespace lightmill
