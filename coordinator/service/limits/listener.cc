#include "coordinator/service/limits/listener.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/error.h"
#include "common/rpc/channel.h"
#include "coordinator/service/limits/rate_limiter.h"

namespace lightmill {
namespace {

constexpr int kBacklog = 1024;
constexpr rlim_t kFilesForTheRest = 200;  // store, blobs, HTTP, logs
constexpr std::chrono::milliseconds kOutOfFiles(20);

class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&&) = delete;
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

/// What is open under a descriptor's number now: another inode means that the connection is closed.
ino_t inode_of(int fd) {
  struct stat s {};
  return fstat(fd, &s) == 0 ? s.st_ino : 0;
}

/// The most connections that the limit of open files leaves room for, after raising it.
int raise_file_limit(int wanted) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return wanted;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  if (limit.rlim_cur == RLIM_INFINITY) return wanted;
  const rlim_t room =
      limit.rlim_cur > 2 * kFilesForTheRest ? limit.rlim_cur - kFilesForTheRest : limit.rlim_cur / 2;
  return static_cast<int>(std::min<rlim_t>(static_cast<rlim_t>(wanted), room));
}

/// The numeric address of a peer; IPv4 in IPv6 counts as IPv4.
std::string source_of(const sockaddr_storage& peer) {
  std::array<char, NI_MAXHOST> host{};
  if (getnameinfo(reinterpret_cast<const sockaddr*>(&peer), sizeof peer, host.data(), host.size(), nullptr, 0,
                  NI_NUMERICHOST) != 0) {
    return "?";
  }
  const std::string text = host.data();
  return text.starts_with("::ffff:") ? text.substr(7) : text;
}

int port_of(int fd) {
  sockaddr_storage own{};
  socklen_t size = sizeof own;
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&own), &size) != 0) return 0;
  return ntohs(own.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(own).sin6_port
                                         : reinterpret_cast<const sockaddr_in&>(own).sin_port);
}

void set_port(sockaddr* address, int port) {
  const auto number = htons(static_cast<uint16_t>(port));
  if (address->sa_family == AF_INET6) {
    reinterpret_cast<sockaddr_in6*>(address)->sin6_port = number;
  } else {
    reinterpret_cast<sockaddr_in*>(address)->sin_port = number;
  }
}

/// -1 with errno if it can't be.
int listen_on(const addrinfo& at, bool v6_only) {
  Descriptor fd(socket(at.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (fd.get() < 0) return -1;
  const int yes = 1;
  setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const int only = v6_only ? 1 : 0;
  if (at.ai_family == AF_INET6) setsockopt(fd.get(), IPPROTO_IPV6, IPV6_V6ONLY, &only, sizeof only);
  if (bind(fd.get(), at.ai_addr, at.ai_addrlen) != 0 || listen(fd.get(), kBacklog) != 0) return -1;
  return fd.release();
}

}  // namespace

struct Listener::Impl {
  struct Connection {
    int fd;
    ino_t inode;
  };

  explicit Impl(const ListenerOptions& options)
      : limiter(options.connections_per_second, options.burst),
        max_connections(static_cast<size_t>(raise_file_limit(options.max_connections))) {}

  bool may_enter(const sockaddr_storage& peer) {
    if (connections.size() >= max_connections) {
      std::erase_if(connections, [](const Connection& c) { return inode_of(c.fd) != c.inode; });
    }
    if (connections.size() >= max_connections) return false;
    const double now =
        std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    return limiter.take(source_of(peer), now) == 0;
  }

  void accept_all(int listener) {
    for (;;) {
      sockaddr_storage peer{};
      socklen_t size = sizeof peer;
      Descriptor fd(
          accept4(listener, reinterpret_cast<sockaddr*>(&peer), &size, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (fd.get() < 0) {
        // The connection stays in the backlog until a descriptor is free.
        if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
          std::this_thread::sleep_for(kOutOfFiles);
        }
        if (errno == EINTR || errno == ECONNABORTED) continue;
        return;
      }
      if (!may_enter(peer)) {
        ++refused;
        continue;
      }
      const int yes = 1;
      setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
      connections.push_back({fd.get(), inode_of(fd.get())});
      hand(fd.release());
    }
  }

  void loop() {
    std::vector<pollfd> waits;
    for (const Descriptor& listener : listeners) waits.push_back({listener.get(), POLLIN, 0});
    waits.push_back({wake.get(), POLLIN, 0});
    for (;;) {
      if (poll(waits.data(), waits.size(), -1) < 0 && errno != EINTR) return;
      if (waits.back().revents != 0) return;
      for (size_t i = 0; i + 1 < waits.size(); ++i) {
        if (waits[i].revents != 0) accept_all(waits[i].fd);
      }
    }
  }

  RateLimiter limiter;
  const size_t max_connections;
  std::vector<Descriptor> listeners;
  const Descriptor wake{eventfd(0, EFD_CLOEXEC)};
  int port = 0;
  std::vector<Connection> connections;  // of the thread alone; some may be closed meanwhile
  std::function<void(int)> hand;
  std::atomic<uint64_t> refused{0};
  std::thread thread;
};

Listener::Listener(const ListenerOptions& options) : impl_(std::make_unique<Impl>(options)) {
  const HostPort at = parse_address(options.address);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* list = nullptr;
  const int lookup = getaddrinfo(at.host.c_str(), std::to_string(at.port).c_str(), &hints, &list);
  if (lookup != 0) {
    throw Error(ErrorKind::kFailed,
                "--listen " + options.address + ": no such host: " + gai_strerror(lookup));
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(list, freeaddrinfo);
  int error = EADDRNOTAVAIL;
  for (const addrinfo* a = list; a; a = a->ai_next) {
    if (at.port == 0 && impl_->port != 0) set_port(a->ai_addr, impl_->port);
    const int fd = listen_on(*a, list->ai_next != nullptr);
    if (fd < 0) {
      // A host without IPv6 still has its IPv4 addresses; a port that is taken is an error.
      if (errno == EADDRINUSE || impl_->listeners.empty()) error = errno;
      if (errno == EADDRINUSE) impl_->listeners.clear();
      if (errno == EADDRINUSE) break;
      continue;
    }
    impl_->listeners.emplace_back(fd);
    impl_->port = port_of(fd);
  }
  if (impl_->listeners.empty()) {
    throw Error(ErrorKind::kFailed, "--listen " + options.address + ": can't listen there: " +
                                        std::strerror(error) + "; is the port in use?");
  }
}

Listener::~Listener() {
  if (!impl_->thread.joinable()) return;
  const uint64_t one = 1;
  while (write(impl_->wake.get(), &one, sizeof one) < 0 && errno == EINTR) {
  }
  impl_->thread.join();
}

int Listener::port() const { return impl_->port; }
uint64_t Listener::refused() const { return impl_->refused; }

void Listener::open(std::function<void(int fd)> hand) {
  impl_->hand = std::move(hand);
  impl_->thread = std::thread([this] { impl_->loop(); });
}

}  // namespace lightmill
