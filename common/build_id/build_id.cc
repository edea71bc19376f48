#include "common/build_id/build_id.h"

#include <gnu/libc-version.h>

#include "common/image/partial.h"

namespace lightmill {

std::string project_version() { return LIGHTMILL_VERSION; }

std::string build_id() {
  std::string id = "lightmill " LIGHTMILL_VERSION;
  const std::string revision = LIGHTMILL_REVISION;
  if (!revision.empty()) id += " (" + revision + ")";
  return id + " schema " + std::to_string(kPartialSchema) + ", Embree " LIGHTMILL_EMBREE_VERSION ", OpenImageIO " +
         LIGHTMILL_OPENIMAGEIO_VERSION ", libc " + gnu_get_libc_version();
}

}  // namespace lightmill
