#include "coordinator/access/authenticator.h"

#include <openssl/evp.h>

#include "common/base/error.h"

namespace lightmill {
namespace {

constexpr size_t kMaxHeader = 4096;

/// The password in the base64 text of "USER:PASSWORD"; empty if it is none.
std::string basic_password(std::string_view text) {
  if (text.empty() || text.size() % 4 != 0) return "";
  std::string plain(text.size() / 4 * 3, '\0');
  const int size =
      EVP_DecodeBlock(reinterpret_cast<unsigned char*>(plain.data()),
                      reinterpret_cast<const unsigned char*>(text.data()), static_cast<int>(text.size()));
  if (size < 0) return "";
  for (size_t padding = 0; padding < 2 && text[text.size() - 1 - padding] == '='; ++padding) plain.pop_back();
  const size_t colon = plain.find(':');
  return colon == std::string::npos ? "" : plain.substr(colon + 1);
}

std::string token_of(std::string_view authorization) {
  constexpr std::string_view kBearer = "Bearer ", kBasic = "Basic ";
  if (authorization.size() > kMaxHeader) return "";
  if (authorization.starts_with(kBearer)) return std::string(authorization.substr(kBearer.size()));
  if (authorization.starts_with(kBasic)) return basic_password(authorization.substr(kBasic.size()));
  return "";
}

Verdict unauthenticated(const std::string& message) { return {Verdict::Kind::kUnauthenticated, message, ""}; }

}  // namespace

Authenticator::Authenticator(std::string path, Log log)
    : path_(std::move(path)),
      log_(std::move(log)),
      stamp_(FileStamp::of(path_)),
      table_(std::make_shared<const TokenTable>(read_tokens(path_))) {}

std::shared_ptr<const TokenTable> Authenticator::table() {
  const std::lock_guard lock(mutex_);
  const FileStamp now = FileStamp::of(path_);
  if (now == stamp_) return table_;
  stamp_ = now;
  try {
    table_ = std::make_shared<const TokenTable>(read_tokens(path_));
    log_("tokens: " + std::to_string(table_->size()) + " read from " + path_);
  } catch (const Error& error) {
    log_(std::string(error.what()) + "; the tokens read before stay in force");
  }
  return table_;
}

Verdict Authenticator::judge(std::string_view path, std::string_view authorization, int64_t now) {
  Verdict verdict = look_up(path, authorization, now);
  if (verdict.kind == Verdict::Kind::kUnauthenticated) ++unauthenticated_;
  if (verdict.kind == Verdict::Kind::kForbidden) ++forbidden_;
  return verdict;
}

Verdict Authenticator::look_up(std::string_view path, std::string_view authorization, int64_t now) {
  const AccessRule* const rule = access_rule(path);
  if (rule && rule->everybody) return {Verdict::Kind::kAllowed, "", ""};
  const std::string token = token_of(authorization);
  if (token.empty()) {
    return unauthenticated("this needs a token; give --token-file FILE, or --credentials DIR");
  }
  const auto tokens = table();
  const TokenEntry* const entry = find_token(*tokens, token);
  if (!entry) return unauthenticated("the token is not known here; ask the farm's admin for a current one");
  if (entry->expires && now >= *entry->expires) {
    return unauthenticated("the token \"" + entry->name + "\" expired on " + utc_text(*entry->expires) +
                           "; ask the farm's admin for a new one");
  }
  if (!rule) return {Verdict::Kind::kForbidden, "nobody may call " + std::string(path.substr(0, 200)), ""};
  if (!may(*rule, entry->role)) {
    return {Verdict::Kind::kForbidden,
            "the token \"" + entry->name + "\" has the role " + role_name(entry->role) + "; this needs " +
                roles_text(*rule),
            entry->name};
  }
  return {Verdict::Kind::kAllowed, "", entry->name};
}

}  // namespace lightmill
