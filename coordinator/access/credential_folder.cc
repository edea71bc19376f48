#include "coordinator/access/credential_folder.h"

#include <fcntl.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/rpc/certificate_text.h"

namespace lightmill {
namespace {

constexpr int64_t kHour = 3600, kDay = 24 * kHour;
constexpr int kAuthorityDays = 3650;
constexpr int64_t kBackdated = kHour;
constexpr const char* kReserved[] = {"ca", "coordinator", ".", ".."};

void make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error || chmod(path.c_str(), 0700) != 0) {
    throw Error(ErrorKind::kFailed, path + ": can't make the folder: " +
                                        (error ? error.message() : std::string(std::strerror(errno))));
  }
}

/// Readable by the owner alone from the first moment, and whole or not there at all.
void write_secret(const std::string& path, const std::string& content) {
  const std::string temporary = path + ".part";
  unlink(temporary.c_str());
  const int fd = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  bool written = fd >= 0;
  for (size_t at = 0; written && at < content.size();) {
    const ssize_t n = write(fd, content.data() + at, content.size() - at);
    written = n > 0;
    if (written) at += static_cast<size_t>(n);
  }
  written = written && fsync(fd) == 0;
  int error = errno;
  if (fd >= 0) close(fd);
  if (written && std::rename(temporary.c_str(), path.c_str()) == 0) return;
  if (written) error = errno;
  unlink(temporary.c_str());
  throw Error(ErrorKind::kFailed, path + ": can't be written: " + std::strerror(error));
}

std::string read_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw Error(ErrorKind::kFailed, path + ": can't be read; make it: lightmill-coordinator init");
  return text.str();
}

bool exists(const std::string& path) { return access(path.c_str(), F_OK) == 0; }

std::string hex(const unsigned char* bytes, size_t size) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (size_t i = 0; i < size; ++i) text += {kDigits[bytes[i] >> 4], kDigits[bytes[i] & 15]};
  return text;
}

/// 256 random bits. The prefix lets scanners for leaked secrets know it.
std::string new_token() {
  std::array<unsigned char, 32> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) {
    throw Error(ErrorKind::kFailed, "OpenSSL has no random numbers for a token");
  }
  return "lightmill-" + hex(bytes.data(), bytes.size());
}

/// Names of this machine and of a certificate that may be there already.
std::vector<std::string> with_usual_names(std::vector<std::string> hosts, const std::string& certificate) {
  if (FILE* file = std::fopen(certificate.c_str(), "re")) {
    const Certificate old(PEM_read_X509(file, nullptr, nullptr, nullptr), X509_free);
    std::fclose(file);
    std::istringstream names(old ? names_of(old) : "");
    for (std::string name; names >> name;) {
      if (name.back() == ',') name.pop_back();
      hosts.push_back(name);
    }
  }
  std::array<char, 256> own{};
  if (gethostname(own.data(), own.size() - 1) == 0 && own[0] != '\0') hosts.emplace_back(own.data());
  for (const char* name : {"localhost", "127.0.0.1", "::1"}) hosts.emplace_back(name);
  std::vector<std::string> unique;
  for (std::string& host : hosts) {
    if (std::find(unique.begin(), unique.end(), host) == unique.end()) unique.push_back(std::move(host));
  }
  return unique;
}

void check_name(const std::string& name) {
  if (!is_token_name(name)) {
    throw Error(ErrorKind::kUsage, "NAME \"" + name + "\": a name has 1 to 64 letters, digits, or . _ - @");
  }
  for (const char* reserved : kReserved) {
    if (name == reserved) throw Error(ErrorKind::kUsage, "NAME \"" + name + "\" is taken; choose another");
  }
}

std::string tokens_text(const TokenTable& table) {
  std::string text = "# NAME ROLE EXPIRES SHA-256-OF-TOKEN; read again whenever it changes\n";
  for (const TokenEntry& entry : table) text += token_line(entry);
  return text;
}

}  // namespace

Validity CredentialFolder::validity(int days) const { return {now_ - kBackdated, now_ + days * kDay}; }

CertificateAuthority CredentialFolder::authority() const {
  return CertificateAuthority({read_text(path_ + "/ca/ca.crt"), read_text(path_ + "/ca/ca.key")});
}

void CredentialFolder::write_identity(const std::string& name, const std::vector<std::string>& hosts,
                                      int days) const {
  const CertificateAuthority ca = authority();
  const PemPair pair = ca.issue(name, hosts, validity(days));
  make_folder(folder_of(name));
  write_secret(folder_of(name) + "/ca.crt", ca.pem().certificate);
  write_secret(folder_of(name) + "/tls.key", pair.key);
  write_secret(folder_of(name) + "/tls.crt", pair.certificate);
}

std::vector<std::string> CredentialFolder::init(const std::vector<std::string>& hosts, int days, bool renew) {
  std::vector<std::string> made;
  make_folder(path_);
  const std::string ca = path_ + "/ca", coordinator = folder_of("coordinator");
  if (!exists(ca + "/ca.key") || !exists(ca + "/ca.crt")) {
    const CertificateAuthority created =
        CertificateAuthority::create("Lightmill farm CA", validity(kAuthorityDays));
    make_folder(ca);
    write_secret(ca + "/ca.crt", created.pem().certificate);
    write_secret(ca + "/ca.key", created.pem().key);
    made.push_back(ca + ": certificate authority");
  }
  const std::string certificate = coordinator + "/tls.crt";
  if (renew || !exists(certificate) || !exists(coordinator + "/tls.key")) {
    write_identity("coordinator", with_usual_names(hosts, certificate), days);
    made.push_back(certificate + ": the coordinator's certificate");
  }
  if (!exists(tokens_path())) {
    write_secret(tokens_path(), tokens_text({}));
    made.push_back(tokens_path() + ": the table of tokens");
  }
  if (!renew) return made;
  for (const auto& entry : std::filesystem::directory_iterator(path_)) {
    const std::string name = entry.path().filename().string();
    if (name == "coordinator" || !exists(entry.path().string() + "/tls.crt")) continue;
    write_identity(name, {}, days);
    made.push_back(folder_of(name) + "/tls.crt: certificate");
  }
  return made;
}

bool CredentialFolder::has(const std::string& name) const { return exists(folder_of(name) + "/token"); }

void CredentialFolder::grant(const std::string& name, Role role, int days, std::optional<int> token_days,
                             double grace_hours) {
  check_name(name);
  TokenTable table = read_tokens(tokens_path());
  const int64_t end = now_ + static_cast<int64_t>(grace_hours * static_cast<double>(kHour));
  for (TokenEntry& entry : table) {
    if (entry.name == name && (!entry.expires || *entry.expires > end)) entry.expires = end;
  }
  std::erase_if(table, [&](const TokenEntry& entry) { return entry.expires && *entry.expires <= now_; });
  const std::string token = new_token();
  TokenEntry entry{name, role, std::nullopt, sha256_hex(token)};
  if (token_days) entry.expires = now_ + *token_days * kDay;
  table.push_back(entry);
  write_identity(name, {}, days);
  write_secret(tokens_path(), tokens_text(table));  // known before it is used
  write_secret(folder_of(name) + "/token", token + "\n");
}

void CredentialFolder::revoke(const std::string& name) {
  check_name(name);
  TokenTable table = read_tokens(tokens_path());
  const size_t before = table.size();
  std::erase_if(table, [&](const TokenEntry& entry) { return entry.name == name; });
  if (table.size() == before) {
    throw Error(ErrorKind::kUsage, tokens_path() + " has no token of \"" + name + "\"");
  }
  write_secret(tokens_path(), tokens_text(table));
  for (const char* file : {"token", "tls.key", "tls.crt", "ca.crt"}) {
    unlink((folder_of(name) + "/" + file).c_str());
  }
  rmdir(folder_of(name).c_str());
}

}  // namespace lightmill
