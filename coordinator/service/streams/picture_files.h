#pragma once
// Images as files: what GetPicture and the dashboard send.
#include <functional>
#include <memory>
#include <string>

#include "coordinator/service/streams/image_answers.h"
#include "lightmill/v1/thin_client.pb.h"

namespace lightmill {

/// The bytes of a file of this extension (".exr", ".png"), as write_image writes it and with its errors. It
/// goes through a temporary file whose name holds `name`.
std::string image_file(const Image& image, const ImageWriteOptions& options, const std::string& name,
                       const char* extension);

/// How GetPicture is asked, checked. Throws Error(kUsage) as the RPC says.
struct PictureForm {
  explicit PictureForm(const v1::GetPictureRequest& request);
  enum class Format { kExr, kPng, kRaw };
  Format format = Format::kExr;
  ViewTransform view;
  v1::FetchImageRequest image;  // what is to be resolved for it
};

/// The chunks of one picture. `memory` gives room for a file that has to be made; what is raw goes as it is.
MessageSource<v1::FileChunk> picture_chunks(std::shared_ptr<const ImageAnswer> answer,
                                            const PictureForm& form, AnswerMemory& memory);

}  // namespace lightmill
