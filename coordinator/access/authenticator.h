#pragma once
// Decides whether a call may go through, by its token. Thread-safe.
//
//   Authenticator authenticator("tokens", log);
//   const Verdict v = authenticator.judge("/lightmill.v1.ClientService/GetJob", "Bearer abc", now);
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/file_stamp.h"
#include "coordinator/access/token_table.h"

namespace lightmill {

struct Verdict {
  enum class Kind {
    kAllowed,
    kUnauthenticated,  // no token, an unknown or an expired one
    kForbidden,        // a good token whose role may not do this
  };
  Kind kind = Kind::kUnauthenticated;
  std::string message;  // why not: one line, for the caller
  std::string name;     // of the token; empty if none was needed
};

class Authenticator {
 public:
  using Log = std::function<void(const std::string&)>;
  /// Reads the file of hashes; it is read again when it changes. A changed file that is malformed is logged,
  /// and the last good table stays. Throws Error(kUsage) if it can't be read now.
  Authenticator(std::string path, Log log);

  /// `authorization`: the header's text, "Bearer TOKEN" or, of browsers, "Basic ..." with the token as
  /// password. `now`: seconds since 1970.
  Verdict judge(std::string_view path, std::string_view authorization, int64_t now);
  /// How many were judged so; of kUnauthenticated and kForbidden.
  uint64_t refused(Verdict::Kind kind) const {
    return kind == Verdict::Kind::kForbidden ? forbidden_ : unauthenticated_;
  }

 private:
  Verdict look_up(std::string_view path, std::string_view authorization, int64_t now);
  std::shared_ptr<const TokenTable> table();
  const std::string path_;
  const Log log_;
  std::atomic<uint64_t> unauthenticated_{0}, forbidden_{0};
  std::mutex mutex_;
  FileStamp stamp_;                          // guarded by mutex_
  std::shared_ptr<const TokenTable> table_;  // guarded by mutex_
};

}  // namespace lightmill
