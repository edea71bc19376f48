#pragma once
// A coordinator whose jobs lie in PostgreSQL: it stands by while another one leads the farm, leads when the
// lease is its own, and ends when it has lost it.
#include <signal.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "coordinator/server.h"
#include "coordinator/store/job_store.h"
#include "coordinator/store/postgres/postgres_lease.h"

namespace lightmill {

struct LeadershipOptions {
  std::string store;         // postgresql://...
  std::string advertise;     // HOST:PORT that others reach this coordinator by; empty: from --listen
  double lease_seconds = 6;  // without a renewal, until another one takes over
};

/// Ports that a server got.
struct Ports {
  int rpc = 0, http = 0;
};

class Leadership {
 public:
  /// `signals` end the program; they are blocked. `listening` is told the ports as soon as there are any,
  /// also those of a standby.
  Leadership(const LeadershipOptions& options, const sigset_t& signals,
             std::function<void(const Ports&)> listening);

  /// What main does with a store: serves under `server` until a signal, or until ended() returns a value.
  /// Calls `ready` with the ports.
  struct Turn {
    std::unique_ptr<JobStore> store;
    ServerOptions server;
    std::function<void(const Ports&)> ready;
    std::function<bool()> ended;
  };
  /// Waits for the lease and takes turns until a signal comes. `data`: the shared folder. Throws StoreError
  /// if the database can't be reached at the start, Error(kFailed) once another coordinator has taken over.
  void run(ServerOptions server, const std::string& data, const std::function<void(Turn)>& lead);

 private:
  /// False: a signal came.
  bool wait_for(PostgresLease& lease, ServerOptions& server);
  bool signalled(double seconds) const;
  void listens(const Ports& ports);
  std::string advertised(const ServerOptions& server, int port) const;

  const LeadershipOptions options_;
  const PostgresUrl url_;
  const sigset_t signals_;
  const std::function<void(const Ports&)> listening_;
  bool listens_ = false;  // others may count on this coordinator: it waits for a database that is away
};

}  // namespace lightmill
