#include "common/image/exr_file.h"

#include <OpenEXR/openexr.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <fstream>
#include <memory>
#include <system_error>

namespace lightmill {
namespace {

/// Longer names need a flag in the file that old readers do not know.
constexpr size_t kLongestShortName = 31;

/// What the library writes to. We open and close it ourselves, so that no error of either is lost.
struct ExrOutput {
  std::ofstream file;
  int error = 0;  // errno of the first failure

  explicit ExrOutput(const std::string& path) : file(path, std::ios::binary) { note(); }
  void note() {
    if (!file && error == 0) error = errno != 0 ? errno : EIO;
  }
};

int64_t write_at(exr_const_context_t, void* output, const void* bytes, uint64_t size, uint64_t offset,
                 exr_stream_error_func_ptr_t) {
  auto& out = *static_cast<ExrOutput*>(output);
  errno = 0;
  if (offset != static_cast<uint64_t>(out.file.tellp())) out.file.seekp(static_cast<std::streamoff>(offset));
  out.file.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size));
  out.note();
  return out.file ? static_cast<int64_t>(size) : -1;
}

/// Its own prints to stderr. What went wrong is told by the code.
void ignore_message(exr_const_context_t, exr_result_t, const char*) {}

std::string local_time() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y:%m:%d %H:%M:%S", &local)};
}

bool has_long_names(const ExrImage& image) {
  const auto is_long = [](const auto& name) { return name.size() > kLongestShortName; };
  return std::any_of(image.channels.begin(), image.channels.end(),
                     [&](const ExrChannel& channel) { return is_long(channel.name); }) ||
         std::any_of(image.attributes.begin(), image.attributes.end(),
                     [&](const auto& attribute) { return is_long(attribute.first); });
}

exr_result_t write_header(const ExrImage& image, exr_context_t exr) {
  int part = 0;
  exr_result_t result = EXR_ERR_SUCCESS;
  const auto step = [&result](exr_result_t next) {
    if (result == EXR_ERR_SUCCESS) result = next;
  };
  if (has_long_names(image)) step(exr_set_longname_support(exr, 1));
  step(exr_add_part(exr, nullptr, EXR_STORAGE_SCANLINE, &part));
  step(exr_initialize_required_attr_simple(exr, part, image.width, image.height, EXR_COMPRESSION_ZIP));
  for (const ExrChannel& channel : image.channels) {
    step(exr_add_channel(exr, part, channel.name.c_str(), channel.half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                         EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
  }
  step(exr_attr_set_string(exr, part, "capDate", local_time().c_str()));
  for (const auto& [name, text] : image.attributes)
    step(exr_attr_set_string(exr, part, name.c_str(), text.c_str()));
  step(exr_write_header(exr));
  return result;
}

/// Where the library takes row `y` of a channel from, and how it steps on.
bool point_at(const ExrImage& image, int y, exr_coding_channel_info_t* coding) {
  const auto channel =
      std::find_if(image.channels.begin(), image.channels.end(),
                   [&](const ExrChannel& candidate) { return candidate.name == coding->channel_name; });
  if (channel == image.channels.end()) return false;
  const size_t row = static_cast<size_t>(image.width) * channel->stride;
  coding->user_data_type = EXR_PIXEL_FLOAT;
  coding->user_bytes_per_element = sizeof(float);
  coding->user_pixel_stride = static_cast<int32_t>(channel->stride * sizeof(float));
  coding->user_line_stride = static_cast<int32_t>(row * sizeof(float));
  coding->encode_from_ptr = reinterpret_cast<const uint8_t*>(channel->values + static_cast<size_t>(y) * row);
  return true;
}

exr_result_t write_pixels(const ExrImage& image, exr_context_t exr) {
  const int part = 0;
  int32_t lines = 0;
  exr_result_t result = exr_get_scanlines_per_chunk(exr, part, &lines);
  exr_encode_pipeline_t encoder{};
  for (int y = 0; y < image.height && result == EXR_ERR_SUCCESS; y += lines) {
    exr_chunk_info_t chunk{};
    result = exr_write_scanline_chunk_info(exr, part, y, &chunk);
    if (result != EXR_ERR_SUCCESS) break;
    result = y == 0 ? exr_encoding_initialize(exr, part, &chunk, &encoder)
                    : exr_encoding_update(exr, part, &chunk, &encoder);
    if (result != EXR_ERR_SUCCESS) break;
    for (int16_t c = 0; c < encoder.channel_count; ++c) {
      if (!point_at(image, y, &encoder.channels[c])) result = EXR_ERR_INVALID_ARGUMENT;
    }
    if (result == EXR_ERR_SUCCESS && y == 0)
      result = exr_encoding_choose_default_routines(exr, part, &encoder);
    if (result == EXR_ERR_SUCCESS) result = exr_encoding_run(exr, part, &encoder);
  }
  exr_encoding_destroy(exr, &encoder);
  return result;
}

}  // namespace

bool write_exr(const ExrImage& image, const std::string& path, std::string* why) {
  errno = 0;
  ExrOutput out(path);
  exr_result_t result = EXR_ERR_SUCCESS;
  if (out.error == 0) {
    exr_context_initializer_t wishes = EXR_DEFAULT_CONTEXT_INITIALIZER;
    wishes.error_handler_fn = ignore_message;
    wishes.user_data = &out;
    wishes.write_fn = write_at;
    exr_context_t exr = nullptr;
    result = exr_start_write(&exr, path.c_str(), EXR_WRITE_FILE_DIRECTLY, &wishes);
    if (result == EXR_ERR_SUCCESS) result = write_header(image, exr);
    if (result == EXR_ERR_SUCCESS) result = write_pixels(image, exr);
    const exr_result_t finished = exr_finish(&exr);
    if (result == EXR_ERR_SUCCESS) result = finished;
    errno = 0;
    out.file.close();
    out.note();
  }
  if (out.error != 0) {
    *why = std::error_code(out.error, std::generic_category()).message();
  } else if (result != EXR_ERR_SUCCESS) {
    *why = std::string("OpenEXR says: ") + exr_get_default_error_message(result);
  }
  return out.error == 0 && result == EXR_ERR_SUCCESS;
}

}  // namespace lightmill
