#include "client/terminal/live_view.h"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>

#include "client/terminal/tev_packets.h"
#include "common/base/error.h"

namespace lightmill::client {
namespace {

constexpr const char* kDefaultPort = "14158";  // tev's
constexpr std::chrono::milliseconds kSpacing(1000);
constexpr int kConnectMs = 1000;
constexpr int kSendSeconds = 5;  // for one packet; a viewer that hangs is given up
constexpr size_t kPacketBytes = size_t{4} << 20;

struct Address {
  std::string host, port = kDefaultPort;
};

Address parse(const std::string& text) {
  const auto fail = [&]() -> Error {
    return {ErrorKind::kUsage, "--display " + text + ": expected HOST:PORT, such as localhost:14158"};
  };
  Address address;
  const size_t bracket = text.starts_with('[') ? text.find(']') : 0;
  if (bracket == std::string::npos) throw fail();
  const size_t colon = text.find(':', bracket);
  if (colon != text.rfind(':')) throw fail();
  address.host = bracket > 0 ? text.substr(1, bracket - 1) : text.substr(0, colon);
  if (colon != std::string::npos) address.port = text.substr(colon + 1);
  const bool number = !address.port.empty() && address.port.size() <= 5 &&
                      address.port.find_first_not_of("0123456789") == std::string::npos &&
                      std::stoi(address.port) >= 1 && std::stoi(address.port) <= 65535;
  if (address.host.empty() || !number) throw fail();
  return address;
}

/// A connected socket, or -1 with `why`.
int connect_to(const Address& address, std::string* why) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found)) {
    *why = gai_strerror(error);
    return -1;
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> list(found, freeaddrinfo);
  for (const addrinfo* a = found; a; a = a->ai_next) {
    const int fd = socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
    if (fd < 0) continue;
    int error = connect(fd, a->ai_addr, a->ai_addrlen) == 0 ? 0 : errno;
    if (error == EINPROGRESS) {
      pollfd wait{fd, POLLOUT, 0};
      socklen_t size = sizeof error;
      error = ETIMEDOUT;
      if (poll(&wait, 1, kConnectMs) == 1) getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
    }
    if (error == 0) return fd;
    *why = std::strerror(error);
    close(fd);
  }
  return -1;
}

/// Empty on success, else what went wrong.
std::string send_all(int fd, const std::string& bytes) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(kSendSeconds);
  for (size_t sent = 0; sent < bytes.size();) {
    const ssize_t n = send(fd, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n > 0) {
      sent += static_cast<size_t>(n);
      continue;
    }
    if (n < 0 && errno != EAGAIN && errno != EINTR) return std::strerror(errno);
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    pollfd wait{fd, POLLOUT, 0};
    if (left.count() <= 0 || poll(&wait, 1, static_cast<int>(left.count())) == 0)
      return "it takes no more pixels";
  }
  return "";
}

}  // namespace

void check_display(const std::string& address) { parse(address); }

LiveView::LiveView(const std::string& address, std::string name, std::function<Image()> pull,
                   std::function<void(const std::string&)> warn)
    : address_(address), name_(std::move(name)), warn_(std::move(warn)), pull_(std::move(pull)) {
  check_display(address);
  thread_ = std::thread([this] { run(); });
}

LiveView::~LiveView() { finish(); }

void LiveView::changed() {
  const std::lock_guard lock(mutex_);
  changed_ = true;
  woken_.notify_all();
}

void LiveView::show(std::function<Image()> pull) {
  {
    const std::lock_guard lock(pull_mutex_);
    pull_ = std::move(pull);
  }
  changed();
}

void LiveView::finish() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    woken_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void LiveView::disconnect() {
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
  created_ = false;
}

Image LiveView::pulled() {
  const std::lock_guard lock(pull_mutex_);
  return pull_ ? pull_() : Image();
}

void LiveView::send(const Image& image) {
  std::string why;
  if (socket_ < 0) socket_ = connect_to(parse(address_), &why);
  if (socket_ >= 0 && !created_) {
    why = send_all(socket_, tev_create_image(name_, image.width, image.height));
    created_ = why.empty();
  }
  const size_t row_bytes =
      static_cast<size_t>(image.width) * static_cast<size_t>(image.channels) * sizeof(float);
  const int rows = static_cast<int>(std::max<size_t>(1, kPacketBytes / row_bytes));
  for (int y = 0; created_ && why.empty() && y < image.height; y += rows) {
    why = send_all(socket_, tev_update_rows(name_, image, y, std::min(y + rows, image.height)));
  }
  if (why.empty()) return;
  disconnect();
  if (warned_) return;
  warned_ = true;
  warn_("warning: no picture at the viewer " + address_ + ": " + why + "; the render goes on");
}

void LiveView::run() {
  for (bool last = false; !last;) {
    {
      std::unique_lock lock(mutex_);
      woken_.wait(lock, [&] { return changed_ || ending_; });
      changed_ = false;
      last = ending_;
    }
    try {
      const Image image = pulled();
      if (!image.data.empty()) send(image);
    } catch (const std::exception& e) {
      if (!warned_) warn_("warning: no picture for the viewer " + address_ + ": " + e.what());
      warned_ = true;
    }
    if (last) break;
    std::unique_lock lock(mutex_);
    woken_.wait_for(lock, kSpacing, [&] { return ending_; });
  }
  disconnect();
}

}  // namespace lightmill::client
