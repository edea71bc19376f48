#pragma once
// Answers that come in parts: pages of lists, and streams of states.
#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "client/connection/farm_connection.h"
#include "common/base/error.h"
#include "common/farm/farm_types.h"
#include "common/rpc/tls_diagnosis.h"

namespace lightmill::client {

/// Asks for page after page. `take` returns how much there is by now, 0 for an empty page. A coordinator that
/// repeats itself, or goes on for ever, does not hold us.
template <class Method, class Request, class Take>
void turn_pages(FarmConnection& farm, Method method, Request request, Take&& take) {
  constexpr size_t kMostListed = 1000000;  // ten times the jobs that a coordinator takes
  for (;;) {
    const auto page = farm.call(method, request);
    const size_t taken = take(page);
    if (taken == 0 || taken >= kMostListed || page.next_page_token().empty() ||
        page.next_page_token() == request.page_token()) {
      return;
    }
    request.set_page_token(page.next_page_token());
  }
}

/// The coordinator went away, or is about to.
inline bool is_loss(grpc::StatusCode code) {
  return code == grpc::StatusCode::UNAVAILABLE || code == grpc::StatusCode::DEADLINE_EXCEEDED ||
         code == grpc::StatusCode::CANCELLED || code == grpc::StatusCode::UNKNOWN ||
         code == grpc::StatusCode::INTERNAL;
}

/// Reads a stream of statuses to the end and returns the last one. `kind` ("job") and `id` say whose they
/// are; `open` opens the stream, `take` turns a message into a status, `observe` gets each. A coordinator
/// that restarts meanwhile is waited for, up to a minute; `lost` is told once per loss.
template <class Status, class Response, class Open, class Take>
Status watch_stream(FarmConnection& farm, const std::string& kind, const std::string& id, Open open,
                    Take take, const std::function<void(const Status&)>& observe,
                    const std::function<void(const std::string&)>& lost) {
  using Steady = std::chrono::steady_clock;
  constexpr double kWatchSeconds = 86400;   // a stream; it is opened again when it ends by this
  constexpr double kConnectSeconds = 6;     // patience of a first connection: a coordinator may be starting
  constexpr double kReconnectSeconds = 60;  // a coordinator that restarts is back by then
  Status last;
  bool connected = false, complained = false;
  bool is_lost = false;
  Steady::time_point lost_at{};
  for (;;) {
    grpc::ClientContext context;
    set_deadline(context, kWatchSeconds);
    const auto reader = open(&context);
    Response message;
    while (reader->Read(&message)) {
      last = take(message);
      connected = true;
      complained = false;
      is_lost = false;
      observe(last);
    }
    const grpc::Status status = reader->Finish();
    if (status.ok() && is_final(last.state)) return last;
    if (!status.ok() && !is_loss(status.error_code())) farm.require_ok(status);
    if (!is_lost) lost_at = Steady::now();
    is_lost = true;
    const double seconds = std::chrono::duration<double>(Steady::now() - lost_at).count();
    if (!connected && diagnose_tls(farm.address(), farm.security()).definite) farm.require_ok(status);
    if (!connected && seconds > kConnectSeconds) farm.require_ok(status);
    if (seconds > kReconnectSeconds) {
      throw Error(ErrorKind::kUnreachable, "coordinator " + farm.address() + " did not come back; the " +
                                               kind + " goes on once it does: lightmill watch " + id);
    }
    if (connected && !complained && !status.ok()) {
      lost("lost the coordinator at " + farm.address() + "; trying again");
      complained = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    farm.connect_anew();
  }
}

}  // namespace lightmill::client
