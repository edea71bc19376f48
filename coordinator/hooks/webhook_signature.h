#pragma once
// Signatures of webhooks, by the Standard Webhooks specification 1.0 (standardwebhooks.com), for which there
// are libraries in all languages: base64 of HMAC-SHA256 over "id.timestamp.body".
#include <cstdint>
#include <string>

namespace lightmill {

/// A key that the coordinator and those it calls share.
class WebhookSecret {
 public:
  /// Text "whsec_" and the key in base64. Throws Error(kUsage) for another text, or a key of less than 24 or
  /// more than 64 bytes.
  explicit WebhookSecret(const std::string& text);
  /// The header webhook-signature. `unix_seconds` is the header webhook-timestamp.
  std::string sign(const std::string& id, int64_t unix_seconds, const std::string& body) const;

 private:
  std::string key_;
};

/// The text in a file, which is made with a new secret that only this user can read if it is not there.
/// Throws Error(kFailed), and Error(kUsage) as WebhookSecret.
WebhookSecret webhook_secret_of(const std::string& path);

}  // namespace lightmill
