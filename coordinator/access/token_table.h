#pragma once
// The accepted tokens. The file holds one a line, NAME ROLE EXPIRES HASH, where EXPIRES is "never" or a UTC
// time as 2027-01-31T12:00:00Z and HASH the SHA-256 of the token in hexadecimal; # starts a comment. Tokens
// have 256 random bits, so a plain hash gives nothing away.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/access/access.h"

namespace lightmill {

struct TokenEntry {
  std::string name;  // of the holder: 1 to 64 letters, digits, or any of ._-@
  Role role = Role::kObserver;
  std::optional<int64_t> expires;  // seconds since 1970, UTC
  std::string hash;                // SHA-256, 64 hexadecimal digits
};

using TokenTable = std::vector<TokenEntry>;

/// Throws Error(kUsage) naming FILE:LINE. `path` is for messages.
TokenTable parse_tokens(const std::string& text, const std::string& path);
/// Throws Error(kUsage) if the file can't be read or is malformed.
TokenTable read_tokens(const std::string& path);
/// Whether a holder may be called so.
bool is_token_name(const std::string& name);
/// The line of an entry, with its end.
std::string token_line(const TokenEntry& entry);

/// The entry of a token, whether or not it has expired; empty if there is none. Takes the same time whichever
/// matches, and however much of a hash does.
const TokenEntry* find_token(const TokenTable& table, std::string_view token);

/// "2027-01-31T12:00:00Z".
std::string utc_text(int64_t seconds);

}  // namespace lightmill
