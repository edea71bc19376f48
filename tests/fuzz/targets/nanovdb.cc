// NanoVDB files.
#include "common/scene/volume/nanovdb/nanovdb.h"

#include "common/base/error.h"
#include "tests/fuzz/targets/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  const fuzz::MemoryFile file({reinterpret_cast<const char*>(data), size});
  const std::string path = static_cast<const FileSource&>(file).resolve("");
  try {
    for (const VolumeGridEntry& e : list_nanovdb(path)) {
      if (e.why_not.empty()) read_nanovdb(path, e.name);
    }
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): refused
  }
  return 0;
}
