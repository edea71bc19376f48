#include "coordinator/http/http_watch.h"

#include <dirent.h>
#include <httplib.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <memory>
#include <tuple>
#include <vector>

namespace lightmill {
namespace {

constexpr std::chrono::seconds kPause(1);

int port_of(const sockaddr_storage& address) {
  return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                                             : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

std::string name_of(const std::string& address, int port) { return address + " " + std::to_string(port); }

/// As the library has it in a request; empty for a socket without a peer.
std::string peer_of(int fd) {
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  std::array<char, NI_MAXHOST> host{};
  if (getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &size) != 0 ||
      getnameinfo(reinterpret_cast<const sockaddr*>(&peer), size, host.data(), host.size(), nullptr, 0,
                  NI_NUMERICHOST) != 0) {
    return "";
  }
  return name_of(host.data(), port_of(peer));
}

int local_port(int fd) {
  sockaddr_storage own{};
  socklen_t size = sizeof own;
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&own), &size) != 0) return 0;
  return own.ss_family == AF_INET || own.ss_family == AF_INET6 ? port_of(own) : 0;
}

/// The inode of a socket; 0 for anything else.
ino_t socket_inode(int fd) {
  struct stat s {};
  return fstat(fd, &s) == 0 && S_ISSOCK(s.st_mode) ? s.st_ino : 0;
}

std::vector<int> open_descriptors() {
  std::vector<int> all;
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(opendir("/proc/self/fd"), closedir);
  if (!folder) return all;
  while (const dirent* entry = readdir(folder.get())) {
    int fd = -1;
    const char* const end = entry->d_name + std::strlen(entry->d_name);
    if (std::from_chars(entry->d_name, end, fd).ptr == end && fd >= 0) all.push_back(fd);
  }
  return all;
}

}  // namespace

HttpWatch::HttpWatch(httplib::Server& server) {
  server.set_logger([this](const httplib::Request& request, const httplib::Response&) { ended(request); });
}

HttpWatch::~HttpWatch() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  ending_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void HttpWatch::start(int port) {
  port_ = port;
  thread_ = std::thread([this] {
    std::unique_lock lock(mutex_);
    while (!ending_.wait_for(lock, kPause, [&] { return ended_; })) look();
  });
}

void HttpWatch::began(const httplib::Request& request) {
  const std::lock_guard lock(mutex_);
  Connection& connection = connections_[name_of(request.remote_addr, request.remote_port)];
  connection.serving = true;
  connection.seen = looks_;
}

void HttpWatch::ended(const httplib::Request& request) {
  const std::lock_guard lock(mutex_);
  const auto found = connections_.find(name_of(request.remote_addr, request.remote_port));
  if (found == connections_.end()) return;
  found->second.serving = false;
  found->second.since = std::chrono::steady_clock::now();
}

void HttpWatch::find_connections(Time now) {
  ++looks_;
  std::unordered_set<ino_t> others;
  for (const int fd : open_descriptors()) {
    const ino_t inode = socket_inode(fd);
    if (inode == 0) continue;
    const std::string peer = others_.contains(inode) || local_port(fd) != port_ ? "" : peer_of(fd);
    if (peer.empty()) {
      others.insert(inode);
      continue;
    }
    Connection& connection = connections_[peer];
    if (connection.inode != inode && !connection.serving) connection.since = now;
    connection.inode = inode;
    connection.fd = fd;
    connection.seen = looks_;
  }
  others_ = std::move(others);
  std::erase_if(connections_, [&](const auto& item) { return item.second.seen + 1 < looks_; });
}

void HttpWatch::look() {
  const Time now = std::chrono::steady_clock::now();
  find_connections(now);
  const auto silence = [&](const Connection* c) {
    return std::chrono::duration<double>(now - c->since).count();
  };
  std::vector<const Connection*> silent;
  for (const auto& [peer, connection] : connections_) {
    if (!connection.serving && connection.fd >= 0 && silence(&connection) > kGraceSeconds)
      silent.push_back(&connection);
  }
  // The oldest first: numbers of sockets grow.
  std::sort(silent.begin(), silent.end(), [](const auto* a, const auto* b) {
    return std::tie(a->since, a->inode) < std::tie(b->since, b->inode);
  });
  for (size_t i = 0; i < silent.size(); ++i) {
    if (silent.size() - i > kMostSilent || silence(silent[i]) > kMostSilentSeconds) close(*silent[i]);
  }
}

void HttpWatch::close(const Connection& connection) {
  const int own = dup(connection.fd);  // nobody else can give its number to another socket
  if (own < 0) return;
  if (socket_inode(own) == connection.inode) shutdown(own, SHUT_RDWR);
  ::close(own);
}

}  // namespace lightmill
