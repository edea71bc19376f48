#pragma once
// The packets of tev's network protocol that a picture takes. Each is its own length in bytes (uint32, itself
// included), a type (one byte) and fields: integers are little-endian, strings end in NUL.
#include <string>

#include "common/image/image.h"

namespace lightmill::client {

/// Type 4: a new image, black, of channels R, G and B; it replaces one of the same name.
std::string tev_create_image(const std::string& name, int width, int height);
/// Type 6 ("update, version 3"): rows [y0, y1) of the image's pixels, interleaved as they are.
std::string tev_update_rows(const std::string& name, const Image& image, int y0, int y1);

}  // namespace lightmill::client
