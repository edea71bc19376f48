#pragma once
// A farm on a simulated clock, with a store in memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "coordinator/store/memory_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill::testing {

class FarmFixture : public ::testing::Test {
 protected:
  explicit FarmFixture(const FarmOptions& options = fake_options())
      : farm(std::make_unique<MemoryJobStore>(), clock, options) {}
  static LeaseKey key(const LeaseGrant& grant) { return {grant.job, grant.tile_id, grant.attempt}; }
  CommitResult commit(const WorkerId& worker, const LeaseGrant& grant, double cpu_seconds = 0.1) {
    return farm.commit(worker, key(grant), fake_bytes(grant, cpu_seconds));
  }
  WorkerId join(const std::string& pool = "") { return farm.register_worker(registration("class-a", pool)); }
  std::string error_of(const std::function<void()>& action) {
    try {
      action();
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  }
  FakeClock clock;
  Farm farm;
};

}  // namespace lightmill::testing
