#include "coordinator/service/wanted_blobs.h"

#include <algorithm>
#include <utility>

#include "common/base/utf8.h"
#include "coordinator/store/job_store.h"

namespace lightmill {
namespace {

constexpr size_t kMostName = 200;
constexpr size_t kShownDigits = 12;

std::string note_of(const BundleEntry& first, size_t missing) {
  const std::string name =
      printable_line(first.name, kMostName) + " (blob " + first.digest.substr(0, kShownDigits) + "...)";
  const std::string what =
      missing == 1 ? "file " + name + " of its scene is"
                   : name + " and " + std::to_string(missing - 1) + " other files of its scene are";
  return what + " lost on the coordinator; submit the scene again, or start a worker that has it";
}

}  // namespace

void WantedBlobs::look(const std::string& bundle_digest, bool in_vain) {
  Bundle bundle;
  try {
    bundle = farm_.bundle(bundle_digest);
  } catch (const StoreError&) {
    throw;
  } catch (const Error&) {  // who fetches it is told why
    return;
  }
  Gaps gaps;
  size_t missing = 0;
  const BundleEntry* first = nullptr;
  for (const BundleEntry& entry : bundle.entries) {
    if (blobs_.contains(entry.digest, entry.size)) continue;
    ++missing;
    if (!first) first = &entry;
    if (gaps.size() < kMostNamed) gaps.emplace(entry.digest, entry.size);
  }
  remember(bundle_digest, std::move(gaps));
  farm_.set_missing_file(bundle_digest, first ? note_of(*first, missing) : "", in_vain);
}

void WantedBlobs::remember(const std::string& bundle_digest, Gaps gaps) {
  const std::lock_guard lock(mutex_);
  if (gaps.empty()) {
    gaps_.erase(bundle_digest);
  } else if (gaps_.size() < kMostBundles || gaps_.contains(bundle_digest)) {
    gaps_[bundle_digest] = std::move(gaps);
  }
  any_ = !gaps_.empty();
}

std::optional<std::string> WantedBlobs::next_bundle() {
  {
    const std::lock_guard lock(mutex_);
    if (!round_.empty()) {
      std::string next = std::move(round_.back());
      round_.pop_back();
      return next;
    }
  }
  std::vector<std::string> open = farm_.open_bundles();
  const std::lock_guard lock(mutex_);
  // What no job needs any more is not wanted.
  std::erase_if(
      gaps_, [&](const auto& entry) { return !std::binary_search(open.begin(), open.end(), entry.first); });
  any_ = !gaps_.empty();
  round_ = std::move(open);
  if (round_.empty()) return std::nullopt;
  std::string next = std::move(round_.back());
  round_.pop_back();
  return next;
}

void WantedBlobs::look_around() {
  std::vector<std::pair<std::string, Gaps>> known;
  if (any_) {
    const std::lock_guard lock(mutex_);
    known.assign(gaps_.begin(), gaps_.end());
  }
  for (const auto& [bundle, gaps] : known) {
    const bool changed = std::any_of(gaps.begin(), gaps.end(),
                                     [&](const auto& gap) { return blobs_.contains(gap.first, gap.second); });
    if (changed) look(bundle, false);
  }
  if (const std::optional<std::string> next = next_bundle()) look(*next, false);
}

std::vector<std::string> WantedBlobs::named() const {
  std::vector<std::string> digests;
  if (!any_) return digests;
  const std::lock_guard lock(mutex_);
  for (const auto& [bundle, gaps] : gaps_) {
    for (const auto& [digest, size] : gaps) {
      if (digests.size() == kMostNamed) return digests;
      const bool told = std::find(digests.begin(), digests.end(), digest) != digests.end();
      if (!told && !is_coming(digest)) digests.push_back(digest);
    }
  }
  return digests;
}

bool WantedBlobs::is_coming(const std::string& digest) const {
  const auto coming = coming_.find(digest);
  if (coming == coming_.end()) return false;
  return coming->second.claims >= kMostClaims || clock_.now() - coming->second.since < kClaimSeconds;
}

WantedBlobs::Claim::~Claim() {
  const std::lock_guard lock(wanted_->mutex_);
  const auto coming = wanted_->coming_.find(digest_);
  if (--coming->second.claims == 0) wanted_->coming_.erase(coming);
}

std::unique_ptr<WantedBlobs::Claim> WantedBlobs::claim(const std::string& digest) {
  const std::lock_guard lock(mutex_);
  for (const auto& [bundle, gaps] : gaps_) {
    const auto gap = gaps.find(digest);
    if (gap == gaps.end()) continue;
    if (is_coming(digest)) return nullptr;
    Coming& coming = coming_[digest];
    ++coming.claims;
    coming.since = clock_.now();
    return std::make_unique<Claim>(this, digest, gap->second);
  }
  return nullptr;
}

void WantedBlobs::arrived(const std::string& digest) {
  std::vector<std::string> bundles;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [bundle, gaps] : gaps_) {
      if (gaps.contains(digest)) bundles.push_back(bundle);
    }
  }
  for (const std::string& bundle : bundles) look(bundle, false);
}

}  // namespace lightmill
