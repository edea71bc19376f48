#include "coordinator/leadership.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <cmath>

#include "common/rpc/channel.h"
#include "coordinator/standby.h"
#include "coordinator/store/postgres/postgres_job_store.h"

namespace lightmill {
namespace {

constexpr double kLookSeconds = 0.5;  // between looks at somebody else's lease
constexpr double kRetrySeconds = 1;   // to a database that does not answer

/// The address with the port that was got.
std::string with_port(const std::string& address, int port) {
  const size_t colon = address.rfind(':');
  return (colon == std::string::npos ? "localhost" : address.substr(0, colon)) + ":" + std::to_string(port);
}

std::string own_host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "localhost";
}

}  // namespace

Leadership::Leadership(const LeadershipOptions& options, const sigset_t& signals,
                       std::function<void(const Ports&)> listening)
    : options_(options), url_(options.store), signals_(signals), listening_(std::move(listening)) {
  if (!options_.advertise.empty()) parse_address(options_.advertise);
}

void Leadership::listens(const Ports& ports) {
  listens_ = true;
  listening_(ports);
}

bool Leadership::signalled(double seconds) const {
  const double whole = std::floor(seconds);
  const timespec pause{static_cast<time_t>(whole), static_cast<long>((seconds - whole) * 1e9)};
  const int signal = sigtimedwait(&signals_, nullptr, &pause);
  if (signal > 0) spdlog::info("signal {}: shutting down", signal);
  return signal > 0;
}

std::string Leadership::advertised(const ServerOptions& server, int port) const {
  if (!options_.advertise.empty()) return options_.advertise;
  const std::string host = parse_address(server.listen).host;
  const bool every = host == "0.0.0.0" || host == "::";
  return with_port(every ? own_host_name() + ":0" : server.listen, port);
}

bool Leadership::wait_for(PostgresLease& lease, ServerOptions& server) {
  if (lease.try_take()) return true;
  Standby standby(server);
  const Ports ports{standby.rpc_port(), standby.http_port()};
  // What is said of this coordinator's ports must hold when it leads.
  server.listen = with_port(server.listen, ports.rpc);
  if (!server.http.empty()) server.http = with_port(server.http, ports.http);
  standby.set_leader(lease.holder());
  spdlog::info("standby: {} leads; ready to take over; rpc port {}, http port {}",
               lease.holder().empty() ? "another coordinator" : lease.holder(), ports.rpc, ports.http);
  listens(ports);
  bool complained = false;
  while (!signalled(kLookSeconds)) {
    try {
      if (lease.try_take()) {
        spdlog::warn("taking over from {}",
                     lease.holder().empty() ? "a coordinator that has left" : lease.holder());
        return true;
      }
      standby.set_leader(lease.holder());
      complained = false;
    } catch (const StoreError& error) {
      if (!complained) spdlog::warn("standby: {}", error.what());
      complained = true;
    }
  }
  return false;
}

void Leadership::run(ServerOptions server, const std::string& data, const std::function<void(Turn)>& lead) {
  for (;;) {
    std::optional<PostgresLease> lease;
    try {
      lease.emplace(url_, options_.lease_seconds);
      if (!wait_for(*lease, server)) return;
    } catch (const StoreError& error) {
      if (!listens_) throw;
      spdlog::warn("{}", error.what());
      if (signalled(kRetrySeconds)) return;
      continue;
    }
    const auto ready = [&](const Ports& ports) {
      server.listen = with_port(server.listen, ports.rpc);
      if (!server.http.empty()) server.http = with_port(server.http, ports.http);
      lease->announce(advertised(server, ports.rpc));
      spdlog::info("leading the farm of {}, epoch {}", url_.shown(), lease->epoch());
      listens(ports);
    };
    try {
      lead({std::make_unique<PostgresJobStore>(*lease, data), server, ready,
            [&lease] { return lease->ended().has_value(); }});
    } catch (const StoreError& error) {
      if (!lease->ended()) {
        if (!listens_) throw;
        spdlog::warn("{}", error.what());
        if (signalled(kRetrySeconds)) return;
        continue;
      }
    }
    const std::optional<PostgresLease::End> end = lease->ended();
    if (!end) return;  // a signal
    if (end->taken_over) throw Error(ErrorKind::kFailed, end->line);
    spdlog::warn("{}", end->line);
  }
}

}  // namespace lightmill
