// The glTF reader: .glb by its magic number, else .gltf; with a shutter, too, if there are animations.
#include "tests/fuzz/targets/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const fuzz::MemoryFile file(bytes);
  const char* const name = bytes.starts_with("glTF") ? "scene.glb" : "scene.gltf";
  fuzz::check_load(load_scene(name, file));
  if (bytes.find("animations") == std::string_view::npos) return 0;
  LoadOptions moving;
  moving.pose.time = 0.5;
  moving.pose.animation = "all";
  moving.pose.closes = 0.25;
  fuzz::check_load(load_scene(name, file, moving));
  return 0;
}
