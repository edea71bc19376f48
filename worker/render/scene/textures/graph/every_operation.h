#pragma once
// Every operation of texture graphs, for the digest of a machine's arithmetic.
#include <vector>

namespace lightmill {

/// What all operations, of all dimensions and kinds, make of eight points.
std::vector<float> every_graph_operation();

}  // namespace lightmill
