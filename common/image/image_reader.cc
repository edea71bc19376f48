#include "common/image/image_reader.h"

namespace lightmill {

std::optional<ImageReader> ImageReader::open(const ImageSource& source, std::string* why) {
  const ImageLibrary& library = image_library();
  ImageHeader header;
  File file(library.open(source, &header, why), library.close);
  if (!file) return std::nullopt;
  return ImageReader(library, std::move(file), header);
}

bool ImageReader::read(int begin, int end, float* out, std::string* why) const {
  return library_->read(*file_, begin, end, TexelType::kFloats, out, why);
}
bool ImageReader::read(int begin, int end, uint8_t* out, std::string* why) const {
  return library_->read(*file_, begin, end, TexelType::kBytes, out, why);
}

std::string ImageReader::attribute(const std::string& name) const {
  return library_->attribute(*file_, name);
}

}  // namespace lightmill
