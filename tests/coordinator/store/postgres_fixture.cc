#include "tests/coordinator/store/postgres_fixture.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

namespace lightmill::testing {
namespace {

/// tests/support/postgres.py, which ends when its input does: at the latest with this process.
class Server {
 public:
  Server() {
    std::array<int, 2> input{}, output{};
    if (pipe2(input.data(), O_CLOEXEC) != 0 || pipe2(output.data(), O_CLOEXEC) != 0) {
      throw std::runtime_error("no pipes");
    }
    const std::string script = std::string(LIGHTMILL_SOURCE_DIR) + "/tests/support/postgres.py";
    process_ = fork();
    if (process_ == 0) {
      dup2(input[0], STDIN_FILENO);
      dup2(output[1], STDOUT_FILENO);
      execlp("python3", "python3", script.c_str(), nullptr);
      _exit(77);
    }
    close(input[0]);
    close(output[1]);
    input_ = input[1];
    char c = 0;
    while (read(output[0], &c, 1) == 1 && c != '\n') url_ += c;
    close(output[0]);
  }
  ~Server() {
    close(input_);
    waitpid(process_, nullptr, 0);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  const std::string& url() const { return url_; }

 private:
  pid_t process_ = -1;
  int input_ = -1;
  std::string url_;
};

}  // namespace

std::string fresh_postgres() {
  static Server server;
  static int number = 0;
  if (server.url().empty()) return "";
  const std::string schema = "test" + std::to_string(++number);
  PostgresConnection(PostgresUrl(server.url()), kLongLease).execute("CREATE SCHEMA " + schema);
  return server.url() + "&options=-csearch_path%3D" + schema;
}

PostgresFarm::PostgresFarm(const std::string& url, const std::string& folder, size_t chunk_bytes)
    : lease(PostgresUrl(url), kLongLease) {
  if (!lease.try_take()) throw std::logic_error("somebody else holds the lease");
  store = std::make_unique<PostgresJobStore>(lease, folder, chunk_bytes);
}

}  // namespace lightmill::testing
