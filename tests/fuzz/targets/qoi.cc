// QOI images, as programs open and decode them.
#include <cstdlib>
#include <vector>

#include "common/image/image_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  ImageSource source{"image.qoi"};
  source.contents = data;
  source.bytes = size;
  std::string why;
  const auto image = ImageReader::open(source, &why);
  if (!image) {
    if (why.empty()) abort();
    return 0;
  }
  const ImageHeader& header = image->header();
  const uint64_t pixels = static_cast<uint64_t>(header.width) * static_cast<uint64_t>(header.height);
  if (header.width < 1 || header.height < 1 || pixels > 62 * size) abort();
  std::vector<uint8_t> bytes(pixels * static_cast<size_t>(header.channels));
  std::vector<float> floats(pixels);
  const bool whole = image->read(0, header.channels, bytes.data(), &why);
  if (image->read(1, 2, floats.data(), &why) != whole) abort();
  for (size_t i = 0; whole && i < pixels; ++i) {
    if (floats[i] != static_cast<float>(bytes[i * static_cast<size_t>(header.channels) + 1]) / 255) abort();
  }
  return 0;
}
