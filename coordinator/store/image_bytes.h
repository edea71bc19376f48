#pragma once
// An image as the bytes that a store keeps: width, height, floats.
#include <string>

#include "common/image/image.h"

namespace lightmill {

std::string image_to_bytes(const Image& image);
/// An image without pixels if the bytes are not those of an image.
Image image_from_bytes(const std::string& bytes);

}  // namespace lightmill
