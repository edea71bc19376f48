// What a worker can still do in its sandbox, and what it can't. Each test enters it in a process of its own.
#include "common/sandbox/sandbox.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/error.h"

namespace lightmill {
namespace {

/// Runs checks in a child; the test fails with the text of the first that does not hold.
class Child {
 public:
  void require(bool holds, const char* what) {
    if (!holds && failed_.empty()) failed_ = std::string(what) + ", errno " + std::to_string(errno);
  }
  static std::string run(const std::function<void(Child&)>& body) {
    int ends[2];
    if (pipe(ends) != 0) return "no pipe";
    const pid_t pid = fork();
    if (pid == 0) {
      Child child;
      try {
        body(child);
      } catch (const std::exception& e) {
        child.failed_ = e.what();
      }
      const std::string said = child.failed_ + "\n";
      _exit(write(ends[1], said.data(), said.size()) == static_cast<ssize_t>(said.size()) ? 0 : 1);
    }
    close(ends[1]);
    std::string said;
    char byte = 0;
    while (read(ends[0], &byte, 1) == 1) said += byte;
    close(ends[0]);
    int status = 0;
    waitpid(pid, &status, 0);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
      return "the child died, status " + std::to_string(status);
    return said.substr(0, said.find('\n'));
  }

 private:
  std::string failed_;
};

bool filtered() {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    if (line == "Seccomp:\t2") return true;
  }
  return false;
}

TEST(Sandbox, ForbidsWhatARendererDoesNotDo) {
  EXPECT_EQ(Child::run([](Child& child) {
              enter_sandbox({});
              child.require(prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1, "no new privileges");
              child.require(filtered(), "system calls are filtered");
              char* const program[] = {const_cast<char*>("/bin/true"), nullptr};
              child.require(execv(program[0], program) == -1 && errno == EPERM, "no other programs");
              child.require(fork() == -1, "no other processes");
              child.require(std::system("true") != 0, "no shell");
              child.require(ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) == -1 && errno == EPERM,
                            "no tracing");
              child.require(setuid(0) == -1 && errno == EPERM, "no other user");
              child.require(chroot("/") == -1 && errno == EPERM, "no other root");
              child.require(socket(AF_PACKET, SOCK_RAW, 0) == -1 && errno == EPERM, "no raw packets");
              const int fd = socket(AF_INET, SOCK_STREAM, 0);
              child.require(listen(fd, 1) == -1 && errno == EPERM, "nobody connects to us");
            }),
            "");
}

TEST(Sandbox, LeavesWhatARendererDoes) {
  EXPECT_EQ(Child::run([](Child& child) {
              const int server = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
              sockaddr_in at{};
              at.sin_family = AF_INET;
              at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
              socklen_t size = sizeof at;
              auto* const address = reinterpret_cast<sockaddr*>(&at);
              child.require(bind(server, address, size) == 0 && listen(server, 1) == 0 &&
                                getsockname(server, address, &size) == 0,
                            "a server, before");
              enter_sandbox({});
              child.require(connect(socket(AF_INET, SOCK_STREAM, 0), address, size) == 0, "connect");
              addrinfo* list = nullptr;
              child.require(getaddrinfo("localhost", "1", nullptr, &list) == 0, "look up names");
              int value = 0;
              std::thread([&] { value = 7; }).join();
              child.require(value == 7, "threads");
              std::string name = "/tmp/lightmill-sandbox-XXXXXX";
              const int file = mkstemp(name.data());
              child.require(file >= 0 && write(file, "x", 1) == 1 && unlink(name.c_str()) == 0,
                            "temporary files");
            }),
            "");
}

TEST(Sandbox, AcceptsWhereAskedToAlsoInThreadsThatWereThere) {
  for (const bool accepts : {true, false}) {
    EXPECT_EQ(Child::run([&](Child& child) {
                const int server = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
                child.require(listen(server, 1) == 0, "a server, before");
                std::atomic<bool> entered{false};
                int answer = 0, program = 0;
                std::thread before([&] {
                  while (!entered) std::this_thread::yield();
                  answer = accept4(server, nullptr, nullptr, 0) == -1 ? errno : 0;
                  char* const arguments[] = {const_cast<char*>("/bin/true"), nullptr};
                  program = execv(arguments[0], arguments) == -1 ? errno : 0;
                });
                enter_sandbox({.user = "", .memory_bytes = 0, .system_calls = true, .accepts = accepts});
                entered = true;
                before.join();
                child.require(answer == (accepts ? EAGAIN : EPERM), "accept");
                child.require(program == EPERM, "no other programs from any thread");
              }),
              "");
  }
}

TEST(Sandbox, AReaderCanOnlyRead) {
  // Made and removed out here: in there nothing can be.
  std::string name = ::testing::TempDir() + "lightmill-sandbox-XXXXXX";
  const int file = mkstemp(name.data());
  ASSERT_TRUE(file >= 0 && write(file, "x", 1) == 1);
  close(file);
  EXPECT_EQ(Child::run([&](Child& child) {
              SandboxOptions options;
              options.network = options.writes = false;
              enter_sandbox(options);
              std::ifstream in(name);
              child.require(in.get() == 'x', "read");
              child.require(open(name.c_str(), O_WRONLY) == -1 && errno == EPERM, "no writing");
              child.require(open(name.c_str(), O_RDWR) == -1 && errno == EPERM, "no changing");
              child.require(open((name + "2").c_str(), O_RDONLY | O_CREAT, 0600) == -1 && errno == EPERM,
                            "no making");
              child.require(open(name.c_str(), O_RDONLY | O_TRUNC) == -1 && errno == EPERM, "no emptying");
              child.require(unlink(name.c_str()) == -1 && errno == EPERM, "no removing");
              child.require(rename(name.c_str(), (name + "2").c_str()) == -1 && errno == EPERM,
                            "no renaming");
              child.require(socket(AF_INET, SOCK_STREAM, 0) == -1 && errno == EPERM, "no network");
              child.require(socket(AF_UNIX, SOCK_STREAM, 0) == -1 && errno == EPERM, "no other programs");
              int value = 0;
              std::thread([&] { value = 7; }).join();
              child.require(value == 7, "threads");
            }),
            "");
  EXPECT_EQ(unlink(name.c_str()), 0);
}

TEST(Sandbox, MemoryEndsWithAMessage) {
  EXPECT_EQ(Child::run([](Child& child) {
              enter_sandbox({.user = "", .memory_bytes = uint64_t{200} << 20});
              std::string said;
              try {
                std::vector<char> large(size_t{1} << 30, 1);
                said = "it fits: " + std::to_string(large.back());
              } catch (const std::exception& e) {
                said = failure_text(e);
              }
              child.require(said ==
                                "out of memory: it takes more than the 0.2 GiB of this worker; raise its "
                                "--memory-limit",
                            said.c_str());
              const std::vector<char> small(size_t{20} << 20, 1);
              child.require(small.back() == 1, "what fits still does");
            }),
            "");
}

TEST(Sandbox, UnknownUsersAreNamed) {
  EXPECT_EQ(Child::run([](Child& child) {
              try {
                enter_sandbox({.user = "nobody-of-this-name"});
                child.require(false, "accepted");
              } catch (const Error& e) {
                child.require(e.exit_code() == 2, e.what());
              }
            }),
            "");
  if (geteuid() != 0) GTEST_SKIP() << "becoming another user needs root";
  EXPECT_EQ(Child::run([](Child& child) {
              enter_sandbox({.user = "nobody"});
              child.require(getuid() != 0 && geteuid() == getuid() && getgid() != 0, "somebody else");
              child.require(access("/etc/shadow", R_OK) == -1, "without root's files");
            }),
            "");
}

TEST(Sandbox, TheUsualLimitIsBelowTheMachine) {
  EXPECT_GT(usual_memory_limit(), uint64_t{64} << 20);
  const auto pages = static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES));
  EXPECT_LT(usual_memory_limit(), pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE)));
}

}  // namespace
}  // namespace lightmill
