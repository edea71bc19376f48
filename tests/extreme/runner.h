#pragma once
// Runs the cases of the extreme suite: which rows there are, how many samples each gets, and its verdict.
//
// A row is one case under one set of strategies. A pilot render with a seed of its own decides the number of
// samples; the row's render (another seed) then has it fixed, so that no count depends on the samples that
// are averaged. One that turns out too noisy is the pilot of a second with a seed of its own. The 16 batches
// are whole sample blocks, whose random numbers are independent.
#include "tests/extreme/case.h"
#include "tests/support/render.h"

namespace lightmill::test {

enum class Verdict { kPass, kNoisy, kSkip, kKnown, kFail };
const char* verdict_name(Verdict verdict);

/// The integrator or set of strategies of a row.
struct Run {
  std::string name;  // "bdpt" or "hit,light-tracing"
  Integrator integrator = Integrator::kBdpt;
  std::optional<Strategies> strategies{};
};

struct Row {
  const Case* subject = nullptr;
  Run run;
  Measurement m;
  int64_t spp = 0;
  Verdict verdict = Verdict::kFail;
  std::string note;
};

struct SuiteOptions {
  bool full = false;   // all 15 sets everywhere, and more samples
  std::string filter;  // text that "name, parameter [run]" must contain
  double largest_z = 4;
  bool noisy_fails = true;  // a row without a note that is too noisy to tell
};

/// "1 closed box, rho 0.5 [bdpt]".
std::string row_title(const Case& subject, const Run& run);
/// pt, lt, bdpt and the sets of families (all, or single ones only) that see all light. pt is hit and next
/// event, lt is light tracing, bdpt is all, and those sets are not repeated.
std::vector<Run> runs_that_see(const Sight& sight, bool every_set);
/// x with P(|normal| >= x) = p.
double normal_deviate(double p);
/// The runs of a case that the options select.
std::vector<Run> runs_of(const Case& subject, const SuiteOptions& options);
Row run_case(const Case& subject, const Run& run, const SuiteOptions& options);
/// The measurement of a render against the answer.
Measurement measure_batches(const Batches& batches, const std::array<double, 3>& exact, double oracle_error);

}  // namespace lightmill::test
