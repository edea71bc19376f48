#include "common/build_id/build_id.h"

#include <gnu/libc-version.h>

#include "common/film/partial.h"
#include "source_digest.h"  // generated

namespace lightmill {

std::string project_version() { return LIGHTMILL_VERSION; }

std::string build_id() {
  return "lightmill " LIGHTMILL_VERSION " (source " LIGHTMILL_SOURCE_DIGEST ") schema " +
         std::to_string(kPartialSchema) +
         ", Embree " LIGHTMILL_EMBREE_VERSION ", OpenImageIO " LIGHTMILL_OPENIMAGEIO_VERSION
         ", Draco " LIGHTMILL_DRACO_VERSION ", libc " +
         gnu_get_libc_version();
}

}  // namespace lightmill
