#include "coordinator/hooks/hook_runner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace lightmill {
namespace {

constexpr double kLookSeconds = 0.5;  // between looks for news

std::string message_id(const EndNote& note) { return note.id + "." + std::to_string(note.count); }

}  // namespace

HookRunner::HookRunner(std::vector<std::unique_ptr<Hook>> hooks, HookNews news, const Clock& clock,
                       std::function<void(const std::string&)> log)
    : hooks_(std::move(hooks)), news_(std::move(news)), clock_(clock), log_(std::move(log)) {
  for (size_t i = 0; i < hooks_.size(); ++i) threads_.emplace_back([this, i] { run(i); });
}

HookRunner::~HookRunner() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  ending_.notify_all();
  for (const auto& hook : hooks_) hook->stop();
  for (std::thread& thread : threads_) thread.join();
}

void HookRunner::run(size_t hook) {
  std::unique_lock lock(mutex_);
  while (!ended_) {
    try {
      look(clock_.now());
    } catch (const std::exception& e) {  // the disk failed: the next look tries again
      log(std::string("hooks: ") + e.what());
    }
    Delivery* const delivery = next(hook, clock_.now());
    if (!delivery) {
      ending_.wait_for(lock, std::chrono::duration<double>(kLookSeconds));
      continue;
    }
    const HookMessage message = delivery->message;  // it stays until this hook is through with it
    lock.unlock();
    std::string why;
    try {
      hooks_[hook]->tell(message);
    } catch (const std::exception& e) {
      why = e.what();
    }
    lock.lock();
    if (why.empty()) {
      delivery->tries[hook].over = true;
    } else if (!ended_) {
      failed(hook, delivery, why, clock_.now());
    }
  }
}

HookRunner::Delivery* HookRunner::next(size_t hook, double now) {
  Delivery* first = nullptr;
  for (auto& [id, delivery] : deliveries_) {
    const Try& mine = delivery.tries[hook];
    if (!mine.over && mine.due <= now && (!first || mine.due < first->tries[hook].due)) first = &delivery;
  }
  return first;
}

void HookRunner::look(double now) {
  if (now < look_at_) return;
  look_at_ = now + kLookSeconds;
  std::vector<std::string> over;
  for (const auto& [id, delivery] : deliveries_) {
    if (std::all_of(delivery.tries.begin(), delivery.tries.end(), [](const Try& t) { return t.over; }))
      over.push_back(id);
  }
  for (const std::string& id : over) settle(id);
  for (const EndNote& note : news_.untold(kMostAtOnce)) {
    const std::string id = message_id(note);
    if (deliveries_.contains(id)) continue;
    std::optional<HookMessage> message = news_.message(note);
    if (!message) continue;
    message->id = id;
    deliveries_.emplace(
        id, Delivery{note, std::move(*message), std::vector<Try>(hooks_.size(), {false, 0, now, now})});
  }
}

void HookRunner::settle(const std::string& id) {
  const auto found = deliveries_.find(id);
  news_.told(found->second.note);
  deliveries_.erase(found);
}

void HookRunner::failed(size_t hook, Delivery* delivery, const std::string& why, double now) {
  Try& mine = delivery->tries[hook];
  ++mine.failures;
  const std::string what =
      "hook " + hooks_[hook]->name() + ": " + delivery->message.type + " of " + delivery->message.subject;
  if (now - mine.first >= kPatience) {
    mine.over = true;
    log(what + " was given up after a day: " + why);
    return;
  }
  mine.due = now + std::min(kLongestWait, kFirstWait * std::exp2(mine.failures - 1));
  if (mine.failures == 1) log(what + " failed, and is tried again: " + why);
}

void HookRunner::log(const std::string& line) const {
  if (log_) log_(line);
}

}  // namespace lightmill
