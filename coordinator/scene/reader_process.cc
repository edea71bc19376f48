#include "coordinator/scene/reader_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/base/error.h"
#include "common/sandbox/sandbox.h"

namespace lightmill {
namespace {

constexpr size_t kMostAnswerBytes = size_t{64} << 20;
constexpr size_t kChunk = size_t{1} << 16;
constexpr int kNice = 10;
constexpr double kLookSeconds = 0.2;  // between looks at whether the program is shutting down

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The child and our end of the socket that is its stdin and stdout. Neither outlives the scope.
class Child {
 public:
  explicit Child(const std::vector<std::string>& command) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) failed();
    end_ = ends[0];
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, ends[1], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    // Signals that the coordinator waits for or ignores end a reader.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none, usual;
    sigemptyset(&none);
    sigemptyset(&usual);
    sigaddset(&usual, SIGPIPE);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &usual);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    std::vector<char*> arguments;
    arguments.reserve(command.size() + 1);
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    const int error = posix_spawn(&pid_, arguments[0], &files, &attributes, arguments.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    close(ends[1]);
    if (error == 0) return;
    close(end_);
    errno = error;
    failed();
  }
  ~Child() {
    close(end_);
    if (pid_ <= 0) return;
    wait(0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Waits until the socket can do it; false once it is too late, or nobody wants it any more.
  bool ready(short events, double until, const std::atomic<bool>& stopping) const {
    for (;;) {
      const double left = std::min(kLookSeconds, until - seconds_now());
      if (left <= 0 || stopping) return false;
      pollfd waited{end_, events, 0};
      const int result = poll(&waited, 1, static_cast<int>(std::ceil(1000 * left)));
      if (result > 0) return true;
      if (result < 0 && errno != EINTR) return false;
    }
  }
  int end() const { return end_; }
  /// Its status once it ended, for which it has until then.
  int wait(double until) {
    int status = 0;
    for (bool patient = true;;) {
      patient = patient && seconds_now() < until;
      if (!patient) kill(pid_, SIGKILL);
      const pid_t ended = waitpid(pid_, &status, patient ? WNOHANG : 0);
      if (ended == pid_ || (ended < 0 && errno != EINTR)) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    pid_ = -1;
    return status;
  }

 private:
  [[noreturn]] static void failed() {
    throw Error(ErrorKind::kFailed, std::string("no process can be started to read the scene: ") +
                                        std::strerror(errno) + "; submit it by lightmill submit");
  }
  pid_t pid_ = -1;
  int end_ = -1;
};

}  // namespace

SceneAnswer ReaderProcess::read(const SceneQuestion& question) const {
  const double until = seconds_now() + limits_.seconds;
  const std::string elsewhere = "; submit it by lightmill submit, which reads it where you are";
  const auto too_slow = [&] {
    if (stopping_) return Error(ErrorKind::kFailed, "the coordinator is shutting down");
    return Error(ErrorKind::kBadScene, "reading the scene took more than " +
                                           std::to_string(std::lround(limits_.seconds)) + " seconds" +
                                           elsewhere);
  };
  Child child(command_);
  const std::string asked = question_to_json(question);
  for (size_t sent = 0; sent < asked.size();) {
    if (!child.ready(POLLOUT, until, stopping_)) throw too_slow();
    const ssize_t n =
        send(child.end(), asked.data() + sent, asked.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n > 0) sent += static_cast<size_t>(n);
    if (n < 0 && errno != EAGAIN && errno != EINTR) break;  // it ended: its status says why
  }
  shutdown(child.end(), SHUT_WR);
  std::string said;
  for (char chunk[kChunk]; said.size() <= kMostAnswerBytes;) {
    if (!child.ready(POLLIN, until, stopping_)) throw too_slow();
    const ssize_t n = recv(child.end(), chunk, sizeof chunk, MSG_DONTWAIT);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) break;
    if (n > 0) said.append(chunk, static_cast<size_t>(n));
  }
  const int status = child.wait(until);
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) throw too_slow();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    const std::string how = WIFSIGNALED(status) ? "signal " + std::to_string(WTERMSIG(status))
                                                : "status " + std::to_string(WEXITSTATUS(status));
    throw Error(ErrorKind::kBadScene, "the scene could not be read here: its reader ended with " + how +
                                          ", maybe as it takes more than --reader-memory" + elsewhere);
  }
  const auto object = nlohmann::json::parse(said, nullptr, false);
  if (object.is_object() && object.contains("refusal") && object["refusal"].is_string())
    throw Error(ErrorKind::kUsage, object["refusal"].get<std::string>());
  return answer_from_json(said, question);
}

int read_scene_and_answer(const ReaderLimits& limits) {
  close_range(STDERR_FILENO + 1, ~0u, 0);
  std::ofstream("/proc/self/oom_score_adj") << 1000;  // if somebody has to go, then this one
  setpriority(PRIO_PROCESS, 0, kNice);
  const auto processors = static_cast<double>(std::max(1L, sysconf(_SC_NPROCESSORS_ONLN)));
  const auto seconds = static_cast<rlim_t>(std::ceil(limits.seconds * processors));
  const rlimit time{seconds, seconds + 1};
  setrlimit(RLIMIT_CPU, &time);
  SandboxOptions sandbox;
  sandbox.memory_bytes = limits.memory_bytes;
  sandbox.network = sandbox.writes = false;
  enter_sandbox(sandbox);
  std::string asked, said;
  char chunk[kChunk];
  for (ssize_t n; (n = ::read(STDIN_FILENO, chunk, sizeof chunk)) != 0;) {
    if (n < 0 && errno != EINTR) return 1;
    if (n > 0) asked.append(chunk, static_cast<size_t>(n));
  }
  try {
    said = answer_to_json(read_scene(question_from_json(asked)));
  } catch (const Error& e) {
    said =
        nlohmann::json{{"refusal", e.what()}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  for (size_t sent = 0; sent < said.size();) {
    const ssize_t n = ::write(STDOUT_FILENO, said.data() + sent, said.size() - sent);
    if (n < 0 && errno != EINTR) return 1;
    if (n > 0) sent += static_cast<size_t>(n);
  }
  return 0;
}

}  // namespace lightmill
