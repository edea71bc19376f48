#pragma once
// An image file that is open for reading, through the image library (image_library.h).
#include <memory>
#include <optional>
#include <string>

#include "common/image/image_library.h"

namespace lightmill {

class ImageReader {
 public:
  /// Nothing, and a reason in `why`, if it can't be opened. Throws Error(kFailed) as image_library().
  static std::optional<ImageReader> open(const ImageSource& source, std::string* why);

  const ImageHeader& header() const { return header_; }
  /// Channels [begin, end) of all pixels, interleaved, top row first. False, and a reason, if the file is
  /// damaged.
  bool read(int begin, int end, float* out, std::string* why) const;
  bool read(int begin, int end, uint8_t* out, std::string* why) const;
  /// A string attribute of the file; empty if it has none.
  std::string attribute(const std::string& name) const;

 private:
  using File = std::unique_ptr<OpenImageFile, void (*)(OpenImageFile*)>;
  ImageReader(const ImageLibrary& library, File file, const ImageHeader& header)
      : library_(&library), file_(std::move(file)), header_(header) {}
  const ImageLibrary* library_;
  File file_;
  ImageHeader header_;
};

}  // namespace lightmill
