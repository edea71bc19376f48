#pragma once
// Images as FetchImage sends them. All who fetch the same state of a job share one.
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "coordinator/core/farm.h"
#include "coordinator/service/limits/answer_memory.h"
#include "coordinator/service/streams/sending_call.h"
#include "lightmill/v1/client.pb.h"

namespace lightmill {

struct ImageAnswer {
  Image image;
  ChannelImage aovs;
  std::map<std::string, std::string> metadata;
  std::shared_ptr<const void> share;  // of the memory
};

/// The header, then the pixels in chunks.
MessageSource<v1::FetchImageResponse> chunks_of(std::shared_ptr<const ImageAnswer> answer);

/// Thread-safe.
class ImageAnswers {
 public:
  /// Both must outlive this.
  ImageAnswers(const Farm& farm, AnswerMemory& memory) : farm_(farm), memory_(memory) {}
  /// Resolves the image, unless somebody is sending it already. Throws as Farm::image and AnswerMemory::take.
  std::shared_ptr<const ImageAnswer> get(const v1::FetchImageRequest& request);

 private:
  std::shared_ptr<const ImageAnswer> resolve(const v1::FetchImageRequest& request,
                                             const JobStatus& job) const;

  const Farm& farm_;
  AnswerMemory& memory_;
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<const ImageAnswer>> answers_;  // guarded by mutex_
};

}  // namespace lightmill
