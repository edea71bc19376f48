#pragma once
// How many calls are under way, of all callers and of each.
#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace lightmill {

/// Thread-safe.
class CallerSlots {
 public:
  CallerSlots(int most, int most_of_one) : most_(most), most_of_one_(most_of_one) {}

  /// A place for one call, given back at the end. Who is not `granted` must turn back.
  class Place {
   public:
    Place(CallerSlots& slots, std::string caller) : slots_(slots), caller_(std::move(caller)) {
      const std::lock_guard lock(slots_.mutex_);
      granted_ = ++slots_.calls_[caller_] <= slots_.most_of_one_;
      granted_ = ++slots_.all_ <= slots_.most_ && granted_;
    }
    ~Place() {
      const std::lock_guard lock(slots_.mutex_);
      --slots_.all_;
      const auto found = slots_.calls_.find(caller_);
      if (--found->second == 0) slots_.calls_.erase(found);
    }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    bool granted() const { return granted_; }

   private:
    CallerSlots& slots_;
    const std::string caller_;
    bool granted_ = false;
  };

 private:
  const int most_, most_of_one_;
  std::mutex mutex_;
  std::map<std::string, int> calls_;  // guarded by mutex_
  int all_ = 0;                       // guarded by mutex_
};

}  // namespace lightmill
