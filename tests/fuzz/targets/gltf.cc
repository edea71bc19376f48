// The glTF reader: .glb by its magic number, else .gltf.
#include "tests/fuzz/targets/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const fuzz::MemoryFile file(bytes);
  fuzz::check_load(load_scene(bytes.starts_with("glTF") ? "scene.glb" : "scene.gltf", file));
  return 0;
}
