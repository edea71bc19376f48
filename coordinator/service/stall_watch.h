#pragma once
// Cancels calls whose peer answers gRPC's pings and yet neither takes what is sent to it nor sends what it
// has announced. Such a call would hold its thread, or its share of the memory for partials, as long as the
// peer likes.
//
//   StallWatch watch(clock, 60);
//   StallWatch::Call call(watch, *context);
//   while (call.read(*reader, &message)) ...     // false a minute after the peer fell silent
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "common/base/clock.h"

namespace lightmill {

/// Thread-safe. One for all calls of a server, which it must outlive.
class StallWatch {
 public:
  /// A peer that moves fewer bytes counts as stalled: a tenth of the slowest line that anybody renders over.
  static constexpr double kLeastBytesPerSecond = 10e3;

  /// A peer gets `seconds` of waiting. The bytes that it moves earn more, never beyond that. `clock` must
  /// outlive this. Unless `by_itself`, only cut_stalled() cancels calls.
  StallWatch(const Clock& clock, double seconds, bool by_itself = true);
  ~StallWatch();
  StallWatch(const StallWatch&) = delete;
  StallWatch& operator=(const StallWatch&) = delete;
  /// Cancels the calls whose time is up.
  void cut_stalled();

  /// One call. Not thread-safe by itself: begin, end, begin, ...
  class Call {
   public:
    /// `context`: of a server's call, of any kind. Must outlive this.
    template <class Context>
    Call(StallWatch& watch, Context& context)
        : watch_(watch), cut_([&context] { context.TryCancel(); }), left_(watch.seconds_) {}
    ~Call() { end(0); }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
    /// From here on it is the peer's turn. If that takes too long the call is cancelled.
    void begin();
    /// The peer has taken or sent `bytes` bytes.
    void end(size_t bytes);
    /// Reads from a stream that blocks. False once it has ended.
    template <class Reader, class Message>
    bool read(Reader& reader, Message* message) {
      begin();
      const bool more = reader.Read(message);
      end(more ? message->ByteSizeLong() : 0);
      return more;
    }
    template <class Writer, class Message>
    bool write(Writer& writer, const Message& message) {
      begin();
      const bool taken = writer.Write(message);
      end(taken ? message.ByteSizeLong() : 0);
      return taken;
    }

   private:
    friend class StallWatch;
    StallWatch& watch_;
    const std::function<void()> cut_;
    double left_;  // seconds of waiting
    double since_ = 0;
    bool waits_ = false;  // has a place
    std::multimap<double, Call*>::iterator place_;
  };

 private:
  const Clock& clock_;
  const double seconds_;
  // A call that is cancelled may end, and give its place back, within the cancelling.
  std::recursive_mutex mutex_;
  std::condition_variable_any ending_;
  // Guarded by mutex_.
  std::multimap<double, Call*> waiting_;  // by when their time is up
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace lightmill
