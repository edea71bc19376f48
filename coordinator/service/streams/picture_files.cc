#include "coordinator/service/streams/picture_files.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "common/base/error.h"

namespace lightmill {
namespace {

constexpr double kMostPictureStops = 100;  // of exposure
constexpr const char* kRawMagic = "LMF2";

[[noreturn]] void refuse_picture(const std::string& why) { throw Error(ErrorKind::kUsage, why); }

/// The first message's part that is not bytes.
void begin_file(const char* type, const std::string& job, const char* extension, uint64_t size,
                v1::FileChunk* message) {
  message->set_content_type(type);
  message->set_file_name(job + extension);
  message->set_file_size(size);
}

/// What comes before the pixels: see GetPictureRequest.format.
std::string raw_head(const ImageAnswer& answer) {
  std::string names = "R\nG\nB";
  for (const std::string& name : answer.aovs.channels) names += "\n" + name;
  const auto channels = answer.image.channels + static_cast<int>(answer.aovs.channels.size());
  const uint32_t numbers[] = {static_cast<uint32_t>(answer.image.width),
                              static_cast<uint32_t>(answer.image.height), static_cast<uint32_t>(channels),
                              static_cast<uint32_t>(names.size())};
  std::string head(kRawMagic);
  head.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
  return head + names;
}

/// Pixels [begin, end) with the channels of both images.
std::string raw_pixels(const ImageAnswer& answer, size_t begin, size_t end) {
  const auto colours = static_cast<size_t>(answer.image.channels), aovs = answer.aovs.channels.size();
  const size_t channels = colours + aovs;
  std::vector<float> values((end - begin) * channels);
  for (size_t pixel = begin; pixel < end; ++pixel) {
    float* const out = &values[(pixel - begin) * channels];
    std::copy_n(&answer.image.data[pixel * colours], colours, out);
    if (aovs > 0) std::copy_n(&answer.aovs.image.data[pixel * aovs], aovs, out + colours);
  }
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

MessageSource<v1::FileChunk> raw_chunks(std::shared_ptr<const ImageAnswer> answer, const std::string& job) {
  const size_t pixels = static_cast<size_t>(answer->image.width) * static_cast<size_t>(answer->image.height);
  const size_t channels = static_cast<size_t>(answer->image.channels) + answer->aovs.channels.size();
  const size_t at_once = std::max<size_t>(1, kSentChunkBytes / (channels * sizeof(float)));
  return [answer = std::move(answer), job, pixels, channels, at_once, begun = false,
          next = size_t{0}](v1::FileChunk* message) mutable {
    message->Clear();
    if (!begun) {
      begun = true;
      message->set_content(raw_head(*answer));
      begin_file("application/octet-stream", job, ".raw",
                 message->content().size() + pixels * channels * sizeof(float), message);
      return true;
    }
    if (next >= pixels) return false;
    const size_t end = std::min(pixels, next + at_once);
    message->set_content(raw_pixels(*answer, next, end));
    next = end;
    return true;
  };
}

}  // namespace

std::string image_file(const Image& image, const ImageWriteOptions& options, const std::string& name,
                       const char* extension) {
  static std::atomic<uint64_t> files{0};
  const std::filesystem::path path = std::filesystem::temp_directory_path() /
                                     ("lightmill-" + name + "-" + std::to_string(++files) + extension);
  struct Remove {
    const std::filesystem::path& path;
    ~Remove() {
      std::error_code ignored;
      std::filesystem::remove(path, ignored);
    }
  } const remove{path};
  write_image(image, path.string(), options);
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

PictureForm::PictureForm(const v1::GetPictureRequest& request) {
  if (request.format() == "png") {
    format = Format::kPng;
  } else if (request.format() == "raw") {
    format = Format::kRaw;
  } else if (!request.format().empty() && request.format() != "exr") {
    refuse_picture("format must be exr, png or raw");
  }
  if (request.with_aovs() && request.max_side() > 0)
    refuse_picture("a preview has no AOVs: leave max_side or with_aovs out");
  if (request.with_aovs() && format == Format::kPng)
    refuse_picture("a PNG has no AOVs: ask for the format exr or raw");
  if (!request.view().empty()) view.curve = view_curve_named(request.view());
  if (!(std::abs(request.exposure()) <= kMostPictureStops))
    refuse_picture("exposure must be a number from -100 to 100");
  view.exposure = request.exposure();
  image.set_job_id(request.job_id());
  image.set_with_aovs(request.with_aovs());
  image.set_max_side(request.max_side());
  image.set_for_display(request.for_display());
}

MessageSource<v1::FileChunk> picture_chunks(std::shared_ptr<const ImageAnswer> answer,
                                            const PictureForm& form, AnswerMemory& memory) {
  const std::string& job = form.image.job_id();
  if (form.format == PictureForm::Format::kRaw) return raw_chunks(std::move(answer), job);
  const bool png = form.format == PictureForm::Format::kPng;
  const char* const extension = png ? ".png" : ".exr";
  auto share = memory.take((answer->image.data.size() + answer->aovs.image.data.size()) * sizeof(float));
  ImageWriteOptions options;
  options.view = form.view;
  options.metadata = answer->metadata;
  options.layers = &answer->aovs;
  auto file = std::make_shared<const std::string>(
      image_file(answer->image, options, std::to_string(getpid()), extension));
  answer.reset();
  return [file = std::move(file), share = std::move(share), job, png, extension,
          at = size_t{0}](v1::FileChunk* message) mutable {
    message->Clear();
    if (at >= file->size()) return false;
    if (at == 0) begin_file(png ? "image/png" : "image/x-exr", job, extension, file->size(), message);
    message->set_content(file->substr(at, kSentChunkBytes));
    at += kSentChunkBytes;
    return true;
  };
}

}  // namespace lightmill
