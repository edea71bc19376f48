#include "coordinator/http_api/request_body.h"

#include <algorithm>
#include <chrono>
#include <string>

#include "common/rpc/request_limits.h"
#include "coordinator/farm/farm_errors.h"

namespace lightmill {
namespace {

constexpr size_t kUsualBody = 4096;  // where a request has no limit of its own
constexpr size_t kJsonFactor = 4;    // a message as JSON is not longer than so many times its bytes
// A body must arrive at this rate, after a while.
constexpr double kBodyPatienceSeconds = 10, kBodyBytesPerSecond = 10e3;

}  // namespace

size_t body_limit(const ApiRoute& route) {
  const auto limit = request_limit(route.call->input_type()->full_name());
  const size_t bytes = limit ? limit->bytes : kUsualBody;
  return std::min(kMaxApiBody, route.body == ApiRoute::Body::kBytes ? bytes : bytes * kJsonFactor);
}

void check_message(const ApiRoute& route, size_t bytes) {
  const auto limit = request_limit(route.call->input_type()->full_name());
  if (!limit || bytes <= limit->bytes) return;
  throw LimitReached("the request has " + std::to_string(bytes) + " bytes; it may have " +
                     std::to_string(limit->bytes));
}

bool read_body(const httplib::ContentReader& reader, std::string* body) {
  const auto begin = std::chrono::steady_clock::now();
  double bytes = 0;
  return reader([&](const char* data, size_t size) {
    if (body) body->append(data, size);
    bytes += static_cast<double>(size);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return seconds < kBodyPatienceSeconds || bytes >= seconds * kBodyBytesPerSecond;
  });
}

}  // namespace lightmill
