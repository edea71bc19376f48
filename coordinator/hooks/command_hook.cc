#include "coordinator/hooks/command_hook.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <vector>

#include "common/base/error.h"
#include "common/base/utf8.h"

namespace lightmill {
namespace {

constexpr size_t kMostOutput = 4096, kMostOutputLine = 200;
constexpr int kLookMilliseconds = 100, kLastReads = 20;

class FileEnd {
 public:
  explicit FileEnd(int file) : file_(file) {
    if (file < 0)
      throw Error(ErrorKind::kFailed, std::string("it can't be started: ") + std::strerror(errno));
  }
  ~FileEnd() {
    if (file_ >= 0) close(file_);
  }
  FileEnd(const FileEnd&) = delete;
  FileEnd& operator=(const FileEnd&) = delete;
  int get() const { return file_; }
  void end() {
    close(file_);
    file_ = -1;
  }

 private:
  int file_;
};

/// A file in memory with this content, to be read from its beginning.
int file_of(const std::string& content) {
  const int file = memfd_create("message", MFD_CLOEXEC);
  if (file < 0) return file;
  for (size_t at = 0; at < content.size();) {
    const ssize_t n = write(file, content.data() + at, content.size() - at);
    if (n <= 0) break;
    at += static_cast<size_t>(n);
  }
  lseek(file, 0, SEEK_SET);
  return file;
}

/// Starts the shell in a process group of its own. Its output goes to `output`.
pid_t start(const std::string& command, const HookMessage& message, int input, int output) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, output, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, output, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, usual;  // the coordinator blocks some, and ignores SIGPIPE
  sigemptyset(&none);
  sigemptyset(&usual);
  sigaddset(&usual, SIGPIPE);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &usual);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  const std::string event = "LIGHTMILL_EVENT=" + message.type, id = "LIGHTMILL_ID=" + message.subject;
  std::vector<char*> environment;
  for (char** entry = environ; *entry; ++entry) environment.push_back(*entry);
  for (const std::string* added : {&event, &id}) environment.push_back(const_cast<char*>(added->c_str()));
  environment.push_back(nullptr);
  const char* arguments[] = {"/bin/sh", "-c", command.c_str(), nullptr};
  pid_t pid = -1;
  const int error =
      posix_spawn(&pid, arguments[0], &files, &attributes, const_cast<char**>(arguments), environment.data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0)
    throw Error(ErrorKind::kFailed, std::string("it can't be started: ") + std::strerror(error));
  return pid;
}

/// The end of what was read, for a message of one line.
std::string last_line(std::string text) {
  while (!text.empty() && std::strchr(" \t\r\n", text.back())) text.pop_back();
  const size_t begin = text.rfind('\n');
  if (begin != std::string::npos) text.erase(0, begin + 1);
  return printable_line(text, kMostOutputLine);
}

/// Reads what is there now, keeping the end. False once nothing will come.
bool read_some(int file, std::string* text) {
  char chunk[kMostOutput];
  const ssize_t n = read(file, chunk, sizeof chunk);
  if (n <= 0) return n < 0 && (errno == EAGAIN || errno == EINTR);
  text->append(chunk, static_cast<size_t>(n));
  if (text->size() > kMostOutput) text->erase(0, text->size() - kMostOutput);
  return true;
}

}  // namespace

void CommandHook::tell(const HookMessage& message) {
  using Clock = std::chrono::steady_clock;
  int ends[2];
  if (pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) ends[0] = ends[1] = -1;
  FileEnd output(ends[0]), their_output(ends[1]);
  FileEnd input(file_of(message.body));
  fcntl(their_output.get(), F_SETFL, 0);  // a pipe like any other for the command
  const pid_t pid = start(command_, message, input.get(), their_output.get());
  their_output.end();

  const auto until = Clock::now() + std::chrono::duration<double>(kSeconds);
  std::string said;
  int status = 0;
  bool open = true, late = false;
  for (;;) {
    const pid_t ended = waitpid(pid, &status, WNOHANG);
    if (ended == pid || (ended < 0 && errno != EINTR)) break;
    late = Clock::now() > until;
    if (late || stopping_) {
      kill(-pid, SIGKILL);
      while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
      }
      break;
    }
    pollfd waited{open ? output.get() : -1, POLLIN, 0};
    if (poll(&waited, 1, open ? kLookMilliseconds : kLookMilliseconds / 10) > 0)
      open = read_some(output.get(), &said);
  }
  // What it said last. A process that it left behind may hold the pipe, and fill it.
  for (int reads = 0; open && reads < kLastReads; ++reads) {
    pollfd waited{output.get(), POLLIN, 0};
    if (poll(&waited, 1, 0) <= 0) break;
    open = read_some(output.get(), &said);
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  const std::string words = last_line(said);
  std::string why = "it was ended by signal " + std::to_string(WTERMSIG(status));
  if (late) why = "it took more than " + std::to_string(static_cast<int>(kSeconds)) + " seconds";
  if (WIFEXITED(status)) why = "it ended with status " + std::to_string(WEXITSTATUS(status));
  throw Error(ErrorKind::kFailed, why + (words.empty() ? "" : ": " + words));
}

}  // namespace lightmill
