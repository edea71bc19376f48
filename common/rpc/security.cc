#include "common/rpc/security.h"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>

#include "common/base/error.h"
#include "common/rpc/certificate_text.h"

namespace lightmill {
namespace {

constexpr size_t kMaxToken = 512;

using File = std::unique_ptr<FILE, int (*)(FILE*)>;

File open_file(const std::string& option, const std::string& path) {
  File file(std::fopen(path.c_str(), "re"), std::fclose);
  if (!file) {
    throw Error(ErrorKind::kUsage, option + " " + path + ": can't be read: " + std::strerror(errno));
  }
  return file;
}

Certificate read_certificate(const std::string& option, const std::string& path) {
  const File file = open_file(option, path);
  Certificate certificate(PEM_read_X509(file.get(), nullptr, nullptr, nullptr), X509_free);
  ERR_clear_error();
  if (!certificate) throw Error(ErrorKind::kUsage, option + " " + path + ": holds no certificate (PEM)");
  return certificate;
}

/// An encrypted key is refused rather than asked for on a terminal.
int no_passphrase(char*, int, int, void*) { return -1; }

void check_key(const SecurityFiles& files, const Certificate& certificate) {
  const File file = open_file("--tls-key", files.key);
  const std::unique_ptr<EVP_PKEY, void (*)(EVP_PKEY*)> key(
      PEM_read_PrivateKey(file.get(), nullptr, no_passphrase, nullptr), EVP_PKEY_free);
  const bool fits = key && X509_check_private_key(certificate.get(), key.get()) == 1;
  ERR_clear_error();
  if (!key) {
    throw Error(ErrorKind::kUsage,
                "--tls-key " + files.key + ": holds no private key (PEM, without a passphrase)");
  }
  if (!fits) {
    throw Error(ErrorKind::kUsage,
                "--tls-key " + files.key + ": is not the key of the certificate " + files.cert);
  }
}

void check_dates(const SecurityFiles& files, const Certificate& certificate) {
  const std::string what = "our certificate " + files.cert;
  if (X509_cmp_current_time(X509_get0_notBefore(certificate.get())) > 0) {
    throw Error(ErrorKind::kUnreachable, what + " " + not_yet_valid_text(certificate));
  }
  if (X509_cmp_current_time(X509_get0_notAfter(certificate.get())) < 0) {
    throw Error(ErrorKind::kUnreachable, what + " " + expired_text(certificate));
  }
}

}  // namespace

std::string read_token(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in)
    throw Error(ErrorKind::kUsage, "--token-file " + path + ": can't be read: " + std::strerror(errno));
  std::string token(kMaxToken + 1, '\0');
  in.read(token.data(), static_cast<std::streamsize>(token.size()));
  token.resize(static_cast<size_t>(in.gcount()));
  while (!token.empty() && (token.back() == '\n' || token.back() == '\r')) token.pop_back();
  bool valid = !token.empty() && token.size() <= kMaxToken;
  for (char c : token) valid = valid && c > 0x20 && c < 0x7f;
  if (!valid) {
    throw Error(ErrorKind::kUsage, "--token-file " + path +
                                       ": holds no token; it is one line without spaces, as made by "
                                       "lightmill-coordinator init");
  }
  return token;
}

SecurityFiles resolve(SecurityFiles files, Side side) {
  const std::string folder = files.folder;
  if (!folder.empty()) {
    const auto fill = [&](std::string& file, const char* name) {
      if (file.empty()) file = folder + "/" + name;
    };
    fill(files.ca, "ca.crt");
    fill(files.cert, "tls.crt");
    fill(files.key, "tls.key");
    fill(files.token, side == Side::kServer ? "tokens" : "token");
  }
  const char* const token_option = side == Side::kServer ? "--tokens" : "--token-file";
  const struct {
    const char* option;
    const std::string& path;
  } parts[] = {{"--tls-ca", files.ca},
               {"--tls-cert", files.cert},
               {"--tls-key", files.key},
               {token_option, files.token}};
  const char *given = nullptr, *missing = nullptr;
  for (const auto& part : parts) (part.path.empty() ? missing : given) = part.option;
  if (!given) return files;
  if (missing) {
    throw Error(ErrorKind::kUsage, std::string(given) + " without " + missing +
                                       ": a secured connection takes all of --tls-ca, --tls-cert, --tls-key "
                                       "and " +
                                       token_option + ", or --credentials DIR for the four of them");
  }
  read_certificate("--tls-ca", files.ca);
  const Certificate certificate = read_certificate("--tls-cert", files.cert);
  check_key(files, certificate);
  check_dates(files, certificate);
  if (side == Side::kClient) read_token(files.token);
  return files;
}

}  // namespace lightmill
