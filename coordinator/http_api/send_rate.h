#pragma once
// Writes to HTTP peers, and gives up on those that take next to nothing: each has a thread while it is sent
// to.
#include <httplib.h>

#include <chrono>
#include <string_view>

namespace lightmill {

class SendRate {
 public:
  /// A peer that makes us wait for longer than this must have taken so much a second.
  static constexpr double kPatienceSeconds = 20, kLeastBytesPerSecond = 10e3;

  /// False if the peer is away or too slow: the answer must end.
  bool write(httplib::DataSink& sink, std::string_view bytes) {
    while (!bytes.empty()) {
      const std::string_view part = bytes.substr(0, kPart);
      const auto begin = std::chrono::steady_clock::now();
      if (!sink.write(part.data(), part.size())) return false;
      waited_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      sent_ += static_cast<double>(part.size());
      if (waited_ > kPatienceSeconds && sent_ < waited_ * kLeastBytesPerSecond) return false;
      bytes.remove_prefix(part.size());
    }
    return true;
  }

 private:
  static constexpr size_t kPart = 16 << 10;
  double waited_ = 0, sent_ = 0;  // seconds, bytes
};

}  // namespace lightmill
