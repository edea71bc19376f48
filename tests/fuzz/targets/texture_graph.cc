// Texture graphs, as the pbrt reader opens them.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "common/base/error.h"
#include "common/scene/texture_graph/read_graph.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  try {
    const GraphFile file = read_texture_graph(std::string(reinterpret_cast<const char*>(data), size), {});
    // Operations read what comes before them.
    int32_t known = 0;
    for (const GraphOperation& o : file.graph.operations) {
      for (int32_t k = 0; k < shape_of(o.op).operands; ++k) {
        if (file.graph.operands.at(static_cast<size_t>(o.first_operand + k)) >= known) abort();
      }
      known += shape_of(o.op).results;
    }
  } catch (const Error& e) {
    if (e.kind() != ErrorKind::kBadScene) abort();
  }
  return 0;
}
