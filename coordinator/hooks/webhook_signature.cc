#include "coordinator/hooks/webhook_signature.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

#include "common/base/error.h"
#include "common/base/random_name.h"

namespace lightmill {
namespace {

constexpr const char* kPrefix = "whsec_";
constexpr size_t kNewKeyBytes = 32, kLeastKeyBytes = 24, kMostKeyBytes = 64;
constexpr size_t kMostFileBytes = 1000;

std::string base64(const unsigned char* bytes, size_t count) {
  std::vector<unsigned char> text(4 * ((count + 2) / 3) + 1);
  const int length = EVP_EncodeBlock(text.data(), bytes, static_cast<int>(count));
  return {text.begin(), text.begin() + length};
}

/// Empty for a text that is none.
std::string from_base64(const std::string& text) {
  if (text.empty() || text.size() % 4 != 0) return "";
  std::vector<unsigned char> bytes(text.size());
  const int length = EVP_DecodeBlock(bytes.data(), reinterpret_cast<const unsigned char*>(text.data()),
                                     static_cast<int>(text.size()));
  if (length < 0) return "";
  const size_t padding = text.ends_with("==") ? 2 : text.ends_with('=') ? 1 : 0;
  return {bytes.begin(), bytes.begin() + length - static_cast<std::ptrdiff_t>(padding)};
}

std::string new_secret() {
  std::array<unsigned char, kNewKeyBytes> key;
  if (RAND_bytes(key.data(), static_cast<int>(key.size())) != 1)
    throw Error(ErrorKind::kFailed, "the system has no random numbers for a secret");
  return kPrefix + base64(key.data(), key.size());
}

/// Makes the file if it is not there. Another coordinator on the same folder may do so at the same time.
void ensure_secret(const std::string& path) {
  if (access(path.c_str(), F_OK) == 0) return;
  const std::string text = new_secret() + "\n", draft = path + "." + random_name();
  const int file = open(draft.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  bool there = file >= 0 && write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
               fsync(file) == 0;
  there = there && (link(draft.c_str(), path.c_str()) == 0 || errno == EEXIST);
  const std::string why = std::strerror(errno);
  if (file >= 0) {
    close(file);
    unlink(draft.c_str());
  }
  if (!there) throw Error(ErrorKind::kFailed, path + ": the secret of the hooks can't be written: " + why);
}

}  // namespace

WebhookSecret::WebhookSecret(const std::string& text) {
  if (text.starts_with(kPrefix)) key_ = from_base64(text.substr(std::strlen(kPrefix)));
  if (key_.size() < kLeastKeyBytes || key_.size() > kMostKeyBytes) {
    throw Error(
        ErrorKind::kUsage,
        "a secret of hooks is \"whsec_\" and 24 to 64 bytes in base64; delete the file for a new one");
  }
}

std::string WebhookSecret::sign(const std::string& id, int64_t unix_seconds, const std::string& body) const {
  const std::string text = id + "." + std::to_string(unix_seconds) + "." + body;
  std::array<unsigned char, EVP_MAX_MD_SIZE> mac;
  unsigned int length = 0;
  if (!HMAC(EVP_sha256(), key_.data(), static_cast<int>(key_.size()),
            reinterpret_cast<const unsigned char*>(text.data()), text.size(), mac.data(), &length))
    throw Error(ErrorKind::kFailed, "a message to a hook can't be signed");
  return "v1," + base64(mac.data(), length);
}

WebhookSecret webhook_secret_of(const std::string& path) {
  ensure_secret(path);
  std::ifstream file(path, std::ios::binary);
  std::string text(kMostFileBytes, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<size_t>(file.gcount()));
  while (!text.empty() && std::strchr(" \t\r\n", text.back())) text.pop_back();
  try {
    return WebhookSecret(text);
  } catch (const Error& e) {
    throw Error(e.kind(), path + ": " + e.what());
  }
}

}  // namespace lightmill
