#include "coordinator/access/token_table.h"

#include <openssl/crypto.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <sstream>

#include "common/base/digest.h"
#include "common/base/error.h"

namespace lightmill {
namespace {

constexpr size_t kMaxFile = size_t{4} << 20;
constexpr size_t kHashDigits = 64;

bool is_hash(const std::string& hash) {
  return hash.size() == kHashDigits && hash.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::optional<int64_t> utc_seconds(const std::string& text) {
  std::tm parts{};
  const char* const end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  if (!end || *end != '\0') return std::nullopt;
  return timegm(&parts);
}

}  // namespace

bool is_token_name(const std::string& name) {
  static constexpr std::string_view kMarks = "._-@";
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || kMarks.find(c) != kMarks.npos;
  });
}

std::string utc_text(int64_t seconds) {
  const std::time_t time = seconds;
  std::tm parts{};
  std::array<char, 40> text{};
  if (!gmtime_r(&time, &parts)) return "?";
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

TokenTable parse_tokens(const std::string& text, const std::string& path) {
  TokenTable table;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto bad = [&](const std::string& what) {
      return Error(ErrorKind::kUsage, path + ":" + std::to_string(number) + ": " + what);
    };
    std::istringstream words(line.substr(0, line.find('#')));
    TokenEntry entry;
    std::string role, expires, more;
    if (!(words >> entry.name)) continue;
    if (!(words >> role >> expires >> entry.hash) || words >> more) {
      throw bad("expected NAME ROLE EXPIRES HASH");
    }
    if (!is_token_name(entry.name)) throw bad("a name has 1 to 64 letters, digits, or . _ - @");
    const auto known = role_from_name(role);
    if (!known) throw bad("unknown role \"" + role + "\"; write submitter, worker, observer or admin");
    entry.role = *known;
    if (expires != "never") {
      entry.expires = utc_seconds(expires);
      if (!entry.expires) throw bad("\"" + expires + "\" is no time; write 2027-01-31T12:00:00Z or never");
    }
    if (!is_hash(entry.hash)) throw bad("a hash is 64 hexadecimal digits, in lower case");
    table.push_back(std::move(entry));
  }
  return table;
}

TokenTable read_tokens(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error(ErrorKind::kUsage, "--tokens " + path + ": can't be read: " + std::strerror(errno));
  std::string text(kMaxFile + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<size_t>(in.gcount()));
  if (in.bad() || text.size() > kMaxFile) {
    throw Error(ErrorKind::kUsage, "--tokens " + path + ": can't be read, or is over 4 MiB");
  }
  return parse_tokens(text, path);
}

std::string token_line(const TokenEntry& entry) {
  return entry.name + " " + role_name(entry.role) + " " +
         (entry.expires ? utc_text(*entry.expires) : "never") + " " + entry.hash + "\n";
}

const TokenEntry* find_token(const TokenTable& table, std::string_view token) {
  const std::string hash = sha256_hex(token);
  const TokenEntry* found = nullptr;
  for (const TokenEntry& entry : table) {
    if (CRYPTO_memcmp(entry.hash.data(), hash.data(), kHashDigits) == 0) found = &entry;
  }
  return found;
}

}  // namespace lightmill
