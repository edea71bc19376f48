#pragma once
// Small pictures in messages (worker.proto, ShowPictureRequest).
#include "common/image/image.h"
#include "lightmill/v1/worker.pb.h"

namespace lightmill {

/// Three channels a pixel.
void set_picture(const Image& picture, v1::ShowPictureRequest* message);
/// Throws Error(kUsage) if its size is not positive or its bytes do not fit.
Image picture_of(const v1::ShowPictureRequest& message);

}  // namespace lightmill
