#pragma once
#include <memory>
#include <string>

#include "coordinator/hooks/hook.h"

namespace httplib {
class Client;
}

namespace lightmill {

/// POSTs the message, signed. Taken if the answer is 2xx within kSeconds; redirects are not followed.
class UrlHook final : public Hook {
 public:
  static constexpr int kSeconds = 10;  // to connect, and for each piece of what is sent and read

  /// Throws Error(kUsage) for an URL that can't be called.
  UrlHook(const std::string& url, WebhookSecret secret);
  ~UrlHook() override;
  std::string name() const override { return origin_; }
  void tell(const HookMessage& message) override;
  void stop() override;

 private:
  std::string origin_, path_;
  const WebhookSecret secret_;
  std::atomic<bool> stopping_{false};
  std::unique_ptr<httplib::Client> client_;
};

}  // namespace lightmill
