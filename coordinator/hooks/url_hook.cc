#include "coordinator/hooks/url_hook.h"

#include <httplib.h>

#include <ctime>

#include "common/base/error.h"

namespace lightmill {
namespace {

constexpr size_t kMostAnswerBytes = size_t{1} << 16;

bool is_plain(const std::string& text) { return text.find_first_of(" \t\r\n\"<>") == std::string::npos; }

}  // namespace

UrlHook::UrlHook(const std::string& url, WebhookSecret secret) : secret_(std::move(secret)) {
  const size_t host = url.find("://") + 3;
  const size_t end = std::min(url.find_first_of("/?#", host), url.size());
  origin_ = url.substr(0, end);
  path_ = url.substr(end, url.find('#') == std::string::npos ? std::string::npos : url.find('#') - end);
  if (!path_.starts_with('/')) path_.insert(0, "/");
  const bool has_user = origin_.find('@') != std::string::npos;
  if (end > host && !has_user && is_plain(url)) client_ = std::make_unique<httplib::Client>(origin_);
  if (!client_ || !client_->is_valid()) {
    throw Error(ErrorKind::kUsage, "--on-done " + url + ": is no URL of the form https://HOST[:PORT]/PATH" +
                                       (has_user ? "; it has no user and password" : ""));
  }
  client_->set_connection_timeout(kSeconds);
  client_->set_read_timeout(kSeconds);
  client_->set_write_timeout(kSeconds);
}
UrlHook::~UrlHook() = default;

void UrlHook::tell(const HookMessage& message) {
  if (stopping_) throw Error(ErrorKind::kFailed, "the coordinator is shutting down");
  const int64_t now = std::time(nullptr);
  httplib::Request request;
  request.method = "POST";
  request.path = path_;
  request.headers = {{"Content-Type", "application/json"},
                     {"User-Agent", "lightmill"},
                     {"webhook-id", message.id},
                     {"webhook-timestamp", std::to_string(now)},
                     {"webhook-signature", secret_.sign(message.id, now, message.body)}};
  request.body = message.body;
  size_t read = 0;  // what it says is of no interest, and must end
  request.content_receiver = [&read](const char*, size_t bytes, uint64_t, uint64_t) {
    read += bytes;
    return read <= kMostAnswerBytes;
  };
  const httplib::Result result = client_->send(request);
  if (!result) throw Error(ErrorKind::kFailed, "it can't be reached: " + httplib::to_string(result.error()));
  if (result->status < 200 || result->status > 299)
    throw Error(ErrorKind::kFailed, "it answered " + std::to_string(result->status));
}

void UrlHook::stop() {
  stopping_ = true;
  client_->stop();
}

}  // namespace lightmill
