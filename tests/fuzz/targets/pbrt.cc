// The pbrt reader: tokenizer, directives, parameters, translators, settings.
#include "common/error.h"
#include "common/settings.h"
#include "tests/fuzz/targets/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  const fuzz::MemoryFile file({reinterpret_cast<const char*>(data), size});
  const LoadResult result = load_scene("scene.pbrt", file);
  fuzz::check_load(result);
  if (!result.ok()) return 0;
  try {
    resolve_settings(result.scene, {});
  } catch (const Error&) {
  }
  return 0;
}
