#include "coordinator/web/answers.h"

#include <nlohmann/json.hpp>

#include "common/base/error.h"
#include "common/rpc/status.h"
#include "coordinator/core/farm.h"
#include "coordinator/store/job_store.h"
#include "coordinator/web/json_views.h"

namespace lightmill {

using httplib::Request;
using httplib::Response;
using nlohmann::json;

namespace {

constexpr size_t kMostDigits = 15;
// With its parameter httplib does not compress it. For browsers it would take brotli at its slowest level:
// half a second for a thousand frames, where writing them takes 20 ms.
constexpr char kJsonType[] = "application/json; charset=utf-8";

int status_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::kUsage:
    case ErrorKind::kBadScene:
      return 400;
    case ErrorKind::kUnreachable:
      return 503;
    case ErrorKind::kFailed:
      break;
  }
  return 409;  // the job's state does not allow it
}

}  // namespace

void answer(Response& response, const json& value, int status) {
  response.status = status;
  response.set_header("Cache-Control", "no-store");
  response.set_content(json_text(value), kJsonType);
}

void refuse(Response& response, int status, const std::string& why) {
  answer(response, {{"error", one_line(why)}}, status);
}

void guarded_answer(Response& response, const std::function<void()>& handler) {
  try {
    handler();
  } catch (const UnknownSequence& e) {
    refuse(response, 404, e.what());
  } catch (const UnknownJob& e) {
    refuse(response, 404, e.what());
  } catch (const LimitReached& e) {
    refuse(response, 429, e.what());
  } catch (const StoreError& e) {
    refuse(response, 503, e.what());
  } catch (const Error& e) {
    refuse(response, status_of(e.kind()), e.what());
  } catch (const std::exception& e) {
    refuse(response, 500, e.what());
  }
}

int64_t whole(const Request& request, const char* name, int64_t fallback) {
  if (!request.has_param(name)) return fallback;
  const std::string text = request.get_param_value(name);
  if (text.empty() || text.size() > kMostDigits || text.find_first_not_of("0123456789") != std::string::npos)
    throw Error(ErrorKind::kUsage, std::string(name) + " must be a whole number from 0");
  return std::stoll(text);
}

}  // namespace lightmill
