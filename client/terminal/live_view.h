#pragma once
// A render shown live in tev (https://github.com/Tom94/tev) or another viewer that speaks its network
// protocol.
//
//   LiveView view("localhost:14158", "cornell", [&] { return farm.image(job); }, print_warning);
//   view.changed();   // whenever there is more to see
//   view.finish();    // the last picture, at the latest a few seconds later
//
// A thread of its own pulls the picture and sends it, so that neither a slow viewer nor none at all delays
// anybody. A viewer that is absent or goes away is warned of once and tried again with every later picture.
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "common/image/image.h"

namespace lightmill::client {

/// Throws Error(kUsage) unless `address` is HOST, HOST:PORT or [HOST]:PORT.
void check_display(const std::string& address);

class LiveView {
 public:
  /// `pull` gives the current picture; it is called by the view's thread, at most about once a second. Empty:
  /// there is none yet.
  LiveView(const std::string& address, std::string name, std::function<Image()> pull,
           std::function<void(const std::string&)> warn);
  ~LiveView();
  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;
  void changed();
  /// From now on `pull` gives the picture, and the one before is not called any more.
  void show(std::function<Image()> pull);
  /// Shows the last picture and ends. Never throws.
  void finish();

 private:
  void run();
  Image pulled();
  void send(const Image& image);
  void disconnect();

  const std::string address_, name_;
  const std::function<void(const std::string&)> warn_;
  std::mutex pull_mutex_;  // while a picture is pulled
  std::function<Image()> pull_;
  std::mutex mutex_;
  std::condition_variable woken_;
  bool changed_ = false, ending_ = false;
  // Of the thread:
  int socket_ = -1;
  bool created_ = false, warned_ = false;
  std::thread thread_;
};

}  // namespace lightmill::client
