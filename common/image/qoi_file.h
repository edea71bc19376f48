#pragma once
// QOI, the "Quite OK Image" format (qoiformat.org, specification of 2022): bytes of RGB or RGBA, packed
// without loss. Our own, as the image library of our systems has no reader of it.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "common/image/image_library.h"

namespace lightmill {

/// By its name: the contents are not looked at.
bool is_qoi(const std::string& path);

/// A QOI file that is open for reading.
class QoiFile {
 public:
  /// Nothing, and a reason in `why`, if it can't be read or can't hold as many pixels as its header says.
  static std::optional<QoiFile> open(const ImageSource& source, std::string* why);

  const ImageHeader& header() const { return header_; }
  /// Channels [begin, end) of all pixels, interleaved, top row first; floats are in [0, 1]. False, and a
  /// reason, if the file ends before its last pixel.
  bool read(int begin, int end, uint8_t* out, std::string* why) const;
  bool read(int begin, int end, float* out, std::string* why) const;

 private:
  QoiFile() = default;
  template <class Value>
  bool unpack(int begin, int end, Value* out, std::string* why) const;

  std::unique_ptr<const std::string> file_;  // what was read, or null:
  const unsigned char* bytes_ = nullptr;     // all of the file
  size_t size_ = 0;
  ImageHeader header_;
};

}  // namespace lightmill
