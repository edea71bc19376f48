#pragma once
// An image file that is open for reading: a PFM or QOI by our own readers, all else through the image library
// (image_library.h). Which it is the name says.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/image/image_library.h"
#include "common/image/pfm_file.h"
#include "common/image/qoi_file.h"

namespace lightmill {

class ImageReader {
 public:
  /// Nothing, and a reason in `why`, if it can't be opened. Throws Error(kFailed) as image_library() if that
  /// is needed.
  static std::optional<ImageReader> open(const ImageSource& source, std::string* why);

  const ImageHeader& header() const { return header_; }
  /// Channels [begin, end) of all pixels, interleaved, top row first. False, and a reason, if the file is
  /// damaged.
  bool read(int begin, int end, float* out, std::string* why) const;
  /// Only of a file whose header says `is_bytes`.
  bool read(int begin, int end, uint8_t* out, std::string* why) const;
  /// A string attribute of the file; empty if it has none.
  std::string attribute(const std::string& name) const;
  /// A name a channel, as the file has them; none for a PFM or QOI.
  std::vector<std::string> channel_names() const;

 private:
  using LibraryFile = std::unique_ptr<OpenImageFile, void (*)(OpenImageFile*)>;
  explicit ImageReader(LibraryFile file, const ImageHeader& header)
      : file_(std::move(file)), header_(header) {}
  explicit ImageReader(PfmFile file)
      : file_(nullptr, nullptr), pfm_(std::make_unique<PfmFile>(std::move(file))), header_(pfm_->header()) {}
  explicit ImageReader(QoiFile file)
      : file_(nullptr, nullptr), qoi_(std::make_unique<QoiFile>(std::move(file))), header_(qoi_->header()) {}
  LibraryFile file_;
  std::unique_ptr<PfmFile> pfm_;  // in place of it,
  std::unique_ptr<QoiFile> qoi_;  // or this
  ImageHeader header_;
};

}  // namespace lightmill
