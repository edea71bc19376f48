#pragma once
// PFM, the portable float map: a header of text, then floats, the bottom row first. Our own, as the image
// library takes longer to load than most such files to read.
//
//   PF          colours; Pf: grey
//   640 480     columns and rows
//   -1.0        its sign says little (-) or big endian, its size what the values are multiplied by
//
// A comment begins with # and ends with its line; it may stand before a number.
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>

#include "common/image/image.h"
#include "common/image/image_library.h"

namespace lightmill {

/// By its name: the contents are not looked at.
bool is_pfm(const std::string& path);

/// A PFM file that is open for reading. Its values are the bits that OpenImageIO gives.
class PfmFile {
 public:
  /// Nothing, and a reason in `why`, if it can't be read or is shorter than its header says.
  static std::optional<PfmFile> open(const ImageSource& source, std::string* why);

  const ImageHeader& header() const { return header_; }
  /// Channels [begin, end) of all pixels, interleaved, top row first.
  bool read(int begin, int end, float* out, std::string* why);

 private:
  PfmFile() = default;
  /// What there is of `size` bytes from `offset`: how many.
  size_t bytes_at(uint64_t offset, size_t size, char* out);

  std::ifstream file_;
  const char* contents_ = nullptr;  // in place of the file
  uint64_t size_ = 0;               // of the file, in bytes
  uint64_t first_ = 0;              // where its floats begin
  ImageHeader header_;
  bool big_endian_ = false;
  float scale_ = 1;
};

/// An image of one or three channels. False, and a reason, if it can't be written.
bool write_pfm(const Image& image, const std::string& path, std::string* why);

}  // namespace lightmill
