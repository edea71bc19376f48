#pragma once
// Cancels calls whose peer answers gRPC's pings and yet neither takes what is sent to it nor sends what it
// has announced. Such a call would hold its place, or its share of the memory for partials, as long as the
// peer likes. And bounds how many calls of a kind there are: when another one comes, the slowest peer goes.
//
//   StallWatch watch(clock, 60);
//   StallWatch::Group uploads(watch, 256);
//   StallWatch::Call call(watch, *context, &uploads);
//   if (!call.admitted()) ...
//   call.begin();      // from here on it is the peer's turn
//   call.end(bytes);
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "common/base/clock.h"

namespace lightmill {

/// Thread-safe. One for all calls of a server, which it must outlive.
class StallWatch {
 public:
  /// A peer that moves fewer bytes counts as stalled: a tenth of the slowest line that anybody renders over.
  static constexpr double kLeastBytesPerSecond = 10e3;
  /// A peer that moves less makes room where memory is short and others wait for it.
  static constexpr double kSlowBytesPerSecond = 1e6;
  /// A call that is as young is not the slowest yet.
  static constexpr double kGraceSeconds = 1;

  /// A peer gets `seconds` of waiting. The bytes that it moves earn more, never beyond that. `clock` must
  /// outlive this. Unless `by_itself`, only cut_stalled() cancels calls.
  StallWatch(const Clock& clock, double seconds, bool by_itself = true);
  ~StallWatch();
  StallWatch(const StallWatch&) = delete;
  StallWatch& operator=(const StallWatch&) = delete;
  /// Cancels the calls whose time is up.
  void cut_stalled();

  class Call;
  /// How a call is cancelled. The call's end waits until that is over, unless it comes from within.
  struct Cut {
    explicit Cut(std::function<void()> how) : cancel(std::move(how)) {}
    const std::function<void()> cancel;
    std::optional<std::thread::id> by;  // guarded by the watch's mutex
  };
  /// Calls of one kind, so many at most.
  class Group {
   public:
    Group(StallWatch& watch, size_t most) : watch_(watch), most_(most) {}
    Group(const Group&) = delete;
    Group& operator=(const Group&) = delete;
    /// Cancels the call whose peer was slowest, in bytes for each second of its turns; false if none is old
    /// enough, or as slow as `rate`.
    bool cut_slowest(double rate);

   private:
    friend class StallWatch;
    /// Its mutex held; null: none.
    Call* slowest(double rate) const;

    StallWatch& watch_;
    const size_t most_;
    std::set<Call*> calls_;  // guarded by the watch's mutex
  };

  /// One call. Not thread-safe by itself: begin, end, begin, ...
  class Call {
   public:
    /// `context`: of a server's call, of any kind. Must outlive this, as must `group`. If the group is full
    /// its slowest call is cancelled; it counts until it has ended.
    template <class Context>
    Call(StallWatch& watch, Context& context, Group* group = nullptr)
        : watch_(watch),
          group_(group),
          cut_(std::make_shared<Cut>([&context] { context.TryCancel(); })),
          left_(watch.seconds_) {
      enter();
    }
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
    /// False if there was no room in the group: the call must end.
    bool admitted() const { return admitted_; }
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
    friend class Group;
    void enter();
    double waited(double now) const { return waited_ + (waits_ ? now - since_ : 0); }

    StallWatch& watch_;
    Group* const group_;
    const std::shared_ptr<Cut> cut_;
    bool admitted_ = true, was_cut_ = false;
    double left_;  // seconds of waiting
    double begun_ = 0, since_ = 0, waited_ = 0, bytes_ = 0;
    bool waits_ = false;  // has a place
    std::multimap<double, Call*>::iterator place_;
  };

 private:
  /// Cancels the call, without the mutex: its end, which may come within the cancelling, wants other locks.
  void cut(std::unique_lock<std::mutex>& lock, Call* call);

  const Clock& clock_;
  const double seconds_;
  std::mutex mutex_;
  std::condition_variable ending_, cut_done_;
  // Guarded by mutex_.
  std::multimap<double, Call*> waiting_;  // by when their time is up
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace lightmill
