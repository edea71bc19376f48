// The PLY reader.
#include <cstdlib>

#include "common/base/error.h"
#include "common/scene/mesh/ply_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  try {
    const TriangleMesh mesh = parse_ply({reinterpret_cast<const char*>(data), size});
    for (const auto& triangle : mesh.triangles) {
      for (const uint32_t vertex : triangle) {
        if (vertex >= mesh.positions.size()) abort();
      }
    }
  } catch (const Error&) {
  }
  return 0;
}
