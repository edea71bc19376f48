// The pbrt reader: tokenizer, directives, parameters, translators, settings.
#include "common/base/error.h"
#include "common/scene/resolve_settings.h"
#include "tests/fuzz/targets/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  const fuzz::MemoryFile file({reinterpret_cast<const char*>(data), size});
  LoadOptions options;
  options.most_generated_triangles = 1 << 17;  // so that no input takes seconds under the sanitizers
  const LoadResult result = load_scene("scene.pbrt", file, options);
  fuzz::check_load(result);
  if (!result.ok()) return 0;
  try {
    resolve_settings(result.scene, {});
  } catch (const Error&) {
  }
  return 0;
}
