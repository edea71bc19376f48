#pragma once
// Writes EXR files by OpenEXR's C library, which starts in under 1 ms: the image library takes longer to load
// than a short render. That reads them.
#include <string>
#include <utility>
#include <vector>

namespace lightmill {

struct ExrChannel {
  std::string name;
  const float* values;  // of the top left pixel; must outlive the image
  size_t stride;        // floats from a pixel to the next; rows follow each other
  bool half;            // stored in half floats
};

/// One part of scan lines from the top, ZIP-compressed.
struct ExrImage {
  int width = 0, height = 0;
  std::vector<ExrChannel> channels;                             // in any order
  std::vector<std::pair<std::string, std::string>> attributes;  // name and text
};

/// Adds the time of writing as the standard attribute capDate. False, and a reason, if it can't be written.
bool write_exr(const ExrImage& image, const std::string& path, std::string* why);

}  // namespace lightmill
