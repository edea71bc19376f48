#include "coordinator/service/streams/image_answers.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/base/error.h"
#include "common/job/aovs.h"

namespace lightmill {
namespace {

/// What an answer depends on.
std::string key_of(const v1::FetchImageRequest& request, const JobStatus& job) {
  std::string key = job.id.value + " " + std::to_string(job.version);
  for (const int part : {request.max_side(), int{request.with_aovs()}, int{request.for_display()}})
    key += " " + std::to_string(part);
  return key;
}

}  // namespace

MessageSource<v1::FetchImageResponse> chunks_of(std::shared_ptr<const ImageAnswer> answer) {
  const auto first = answer->aovs.attributes.begin();
  return [answer = std::move(answer), part = -2, attribute = first,
          at = size_t{0}](v1::FetchImageResponse* message) mutable {
    if (part == -2) {
      v1::FetchImageResponse::Header& header = *message->mutable_header();
      header.set_width(answer->image.width);
      header.set_height(answer->image.height);
      header.set_channels(answer->image.channels);
      for (const auto& [key, value] : answer->metadata) (*header.mutable_metadata())[key] = value;
      for (const std::string& name : answer->aovs.channels) header.add_aov_channels(name);
      part = -1;
      return true;
    }
    for (; part < 0 && attribute != answer->aovs.attributes.end(); ++attribute, at = 0) {
      const auto& [name, text] = *attribute;
      if (at >= text.size()) continue;
      message->mutable_attribute()->set_name(name);
      message->mutable_attribute()->set_text(text.substr(at, kSentChunkBytes));
      at += kSentChunkBytes;
      return true;
    }
    part = std::max(part, 0);
    for (; part < 2; ++part, at = 0) {
      const std::vector<float>& data = part == 0 ? answer->image.data : answer->aovs.image.data;
      const std::string_view bytes(reinterpret_cast<const char*>(data.data()), data.size() * sizeof(float));
      if (at >= bytes.size()) continue;
      message->set_chunk(std::string(bytes.substr(at, kSentChunkBytes)));
      at += kSentChunkBytes;
      return true;
    }
    return false;
  };
}

std::shared_ptr<const ImageAnswer> ImageAnswers::get(const v1::FetchImageRequest& request) {
  if (request.max_side() < 0) throw Error(ErrorKind::kUsage, "max_side must be 0 or above");
  const JobStatus job = farm_.job(JobId{request.job_id()});
  const std::string key = key_of(request, job);
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = answers_.find(key); found != answers_.end()) {
      if (auto answer = found->second.lock()) return answer;
    }
  }
  std::shared_ptr<const ImageAnswer> answer = resolve(request, job);
  const std::lock_guard lock(mutex_);
  std::erase_if(answers_, [](const auto& entry) { return entry.second.expired(); });
  answers_[key] = answer;
  return answer;
}

std::shared_ptr<const ImageAnswer> ImageAnswers::resolve(const v1::FetchImageRequest& request,
                                                         const JobStatus& job) const {
  auto answer = std::make_shared<ImageAnswer>();
  const size_t channels =
      3 + (request.with_aovs() ? aov_channels(job.settings.aovs, job.settings.light_groups).size() : 0);
  const auto pixels = static_cast<uint64_t>(job.settings.grid.crop.area());
  answer->share = memory_.take(pixels * channels * sizeof(float));
  if (request.max_side() > 0) {
    answer->image = reduced(farm_.display_image(job.id), request.max_side());
  } else if (request.with_aovs()) {
    answer->aovs = farm_.aovs(job.id, &answer->image);
  } else {
    answer->image = request.for_display() ? farm_.display_image(job.id) : farm_.image(job.id);
  }
  answer->metadata = farm_.image_metadata(job.id);
  return answer;
}

}  // namespace lightmill
