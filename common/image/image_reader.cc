#include "common/image/image_reader.h"

namespace lightmill {

std::optional<ImageReader> ImageReader::open(const ImageSource& source, std::string* why) {
  if (is_pfm(source.path)) {
    auto pfm = PfmFile::open(source, why);
    if (!pfm) return std::nullopt;
    return ImageReader(std::move(*pfm));
  }
  if (is_qoi(source.path)) {
    auto qoi = QoiFile::open(source, why);
    if (!qoi) return std::nullopt;
    return ImageReader(std::move(*qoi));
  }
  const ImageLibrary& library = image_library();
  ImageHeader header;
  LibraryFile file(library.open(source, &header, why), library.close);
  if (!file) return std::nullopt;
  return ImageReader(std::move(file), header);
}

bool ImageReader::read(int begin, int end, float* out, std::string* why) const {
  if (pfm_) return pfm_->read(begin, end, out, why);
  if (qoi_) return qoi_->read(begin, end, out, why);
  return image_library().read(*file_, begin, end, TexelType::kFloats, out, why);
}
bool ImageReader::read(int begin, int end, uint8_t* out, std::string* why) const {
  if (qoi_) return qoi_->read(begin, end, out, why);
  if (!pfm_) return image_library().read(*file_, begin, end, TexelType::kBytes, out, why);
  *why = "it holds floats, not bytes";
  return false;
}

std::string ImageReader::attribute(const std::string& name) const {
  return pfm_ || qoi_ ? "" : image_library().attribute(*file_, name);
}

std::vector<std::string> ImageReader::channel_names() const {
  return pfm_ || qoi_ ? std::vector<std::string>{} : image_library().channel_names(*file_);
}

}  // namespace lightmill
