#include "common/image/pfm_file.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <vector>

#include "common/base/lower_case.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little);

constexpr size_t kLongestHeader = 4096;  // bytes; with comments

bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Past white space and comments.
std::string_view after_space(std::string_view text) {
  while (!text.empty() && (is_space(text[0]) || text[0] == '#'))
    text.remove_prefix(text[0] == '#' ? std::min(text.find('\n'), text.size()) : 1);
  return text;
}

/// Takes a number, and the space before it, off the front of `text`.
template <class Number>
bool take_number(std::string_view* text, Number* number) {
  std::string_view rest = after_space(*text);
  if (rest.size() > 1 && rest[0] == '+' && rest[1] != '-') rest.remove_prefix(1);
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), *number);
  if (error != std::errc()) return false;
  rest.remove_prefix(static_cast<size_t>(end - rest.data()));
  *text = rest;
  return true;
}

std::string system_error() { return std::error_code(errno, std::generic_category()).message(); }

float swapped(float x) { return std::bit_cast<float>(__builtin_bswap32(std::bit_cast<uint32_t>(x))); }

}  // namespace

bool is_pfm(const std::string& path) { return lower_case(fs::path(path).extension().string()) == ".pfm"; }

std::optional<PfmFile> PfmFile::open(const ImageSource& source, std::string* why) {
  PfmFile file;
  if (source.contents) {
    file.contents_ = static_cast<const char*>(source.contents);
    file.size_ = source.bytes;
  } else {
    std::error_code ec;
    file.size_ = fs::file_size(source.path, ec);
    file.file_.open(source.path, std::ios::binary);
    if (ec || !file.file_) {
      *why = ec ? ec.message() : system_error();
      return std::nullopt;
    }
  }
  char head[kLongestHeader];
  const std::string_view all(head, file.bytes_at(0, sizeof head, head));
  const bool colours = all.starts_with("PF");
  if (!colours && !all.starts_with("Pf")) {
    *why = "it is no PFM file: it begins with neither PF nor Pf";
    return std::nullopt;
  }
  std::string_view text = all.substr(2);
  int width = 0, height = 0;
  float scale = 0;
  // One space ends the header: the next byte may be one of a float.
  const bool complete = take_number(&text, &width) && take_number(&text, &height) &&
                        take_number(&text, &scale) && !text.empty() && is_space(text[0]);
  if (!complete || width < 1 || height < 1 || scale == 0 || !std::isfinite(scale)) {
    *why = "its header is damaged: after PF or Pf it must have columns, rows and a scale that is not 0";
    return std::nullopt;
  }
  file.first_ = all.size() - text.size() + 1;
  const int channels = colours ? 3 : 1;
  const uint64_t row =
      uint64_t{sizeof(float)} * static_cast<uint64_t>(channels) * static_cast<uint64_t>(width);
  const auto rows = static_cast<uint64_t>(height);
  uint64_t there = file.size_ - file.first_;
  // Some programs end lines by two characters. Then one byte too many is there.
  if (text.starts_with("\r\n") && there % row == 1 && there / row == rows) ++file.first_, --there;
  if (there / row < rows) {  // no product, which could overflow
    *why = "it is damaged: after the header it has " + std::to_string(there) + " bytes, not the " +
           std::to_string(width) + " x " + std::to_string(height) + " x " + std::to_string(channels) +
           " floats that the header says";
    return std::nullopt;
  }
  file.header_ = {width, height, 1, channels, false, true, true};
  file.big_endian_ = scale > 0;
  file.scale_ = std::fabs(scale);
  return file;
}

size_t PfmFile::bytes_at(uint64_t offset, size_t size, char* out) {
  if (contents_) {
    const size_t there = std::min<uint64_t>(size, size_ - std::min(offset, size_));
    std::memcpy(out, contents_ + offset, there);
    return there;
  }
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(offset));
  file_.read(out, static_cast<std::streamsize>(size));
  return static_cast<size_t>(file_.gcount());
}

bool PfmFile::read(int begin, int end, float* out, std::string* why) {
  const auto in_file = static_cast<size_t>(header_.channels), first = static_cast<size_t>(begin),
             wanted = static_cast<size_t>(end - begin), width = static_cast<size_t>(header_.width);
  std::vector<float> row(width * in_file);
  const size_t row_bytes = row.size() * sizeof(float);
  uint64_t offset = first_;
  for (auto y = static_cast<size_t>(header_.height); y-- > 0; offset += row_bytes) {
    if (bytes_at(offset, row_bytes, reinterpret_cast<char*>(row.data())) != row_bytes) {
      *why = "it was cut short while it was read";
      return false;
    }
    float* to = out + y * width * wanted;
    for (size_t x = 0; x < width; ++x) {
      for (size_t c = 0; c < wanted; ++c) {
        const float stored = row[x * in_file + first + c];
        *to++ = (big_endian_ ? swapped(stored) : stored) * scale_;
      }
    }
  }
  return true;
}

bool write_pfm(const Image& image, const std::string& path, std::string* why) {
  std::ofstream out(path, std::ios::binary);
  out << (image.channels == 1 ? "Pf\n" : "PF\n") << image.width << ' ' << image.height << "\n-1.0\n";
  const auto row = static_cast<std::streamsize>(static_cast<size_t>(image.width) *
                                                static_cast<size_t>(image.channels) * sizeof(float));
  for (int y = image.height - 1; y >= 0; --y)
    out.write(reinterpret_cast<const char*>(image.pixel(0, y)), row);
  out.close();
  if (!out) *why = system_error();
  return static_cast<bool>(out);
}

}  // namespace lightmill
