#include "tests/extreme/runner.h"

#include <algorithm>
#include <cmath>

#include "worker/render/plan/pilot.h"

namespace lightmill::test {
namespace {

constexpr int kBatches = 16;
constexpr int64_t kLeastSpp = kSuperblockSamples * kBatches;
constexpr double kLargestError = 0.01;  // relative standard error
constexpr double kGuidedError = 0.006;  // leaves room for the pilot's own uncertainty
constexpr double kLeastEffective = 100;
constexpr uint64_t kPilotSeed = 1, kSeed = 2;
/// Paths of the pilot of `auto`: whatever it chooses, the image has to be right.
constexpr int64_t kAutoPaths = 1 << 13;

/// Samples (pixels times spp) that a row may take.
int64_t largest_work(const SuiteOptions& options) { return int64_t{1} << (options.full ? 27 : 21); }

/// Kish's effective number of the pixels' values over all batches: how many equal ones would tell as much.
double effective_samples(const Batches& b, int channel) {
  double sum = 0, squares = 0, largest = 0;
  for (const Image& image : b.images) {
    for (size_t i = static_cast<size_t>(channel); i < image.data.size(); i += 3)
      largest = std::max(largest, double{image.data[i]});
  }
  if (!(largest > 0)) return 0;
  for (const Image& image : b.images) {
    for (size_t i = static_cast<size_t>(channel); i < image.data.size(); i += 3) {
      const double x = image.data[i] / largest;  // squares of 1e30 are no matter in double, of 1e-30 neither
      sum += x;
      squares += x * x;
    }
  }
  return sum * sum / squares;
}

Image mean_image(const Batches& b) {
  Image mean(b.images[0].width, b.images[0].height);
  for (size_t i = 0; i < mean.data.size(); ++i) {
    double sum = 0;
    for (const Image& image : b.images) sum += image.data[i];
    mean.data[i] = static_cast<float>(sum / static_cast<double>(b.images.size()));
  }
  return mean;
}

Batches render(const Setup& setup, const Run& run, int64_t spp, uint64_t seed) {
  RenderSettings settings = settings_for(setup.scene, run.integrator, spp, setup.max_depth, seed);
  if (run.strategies) settings.plan = SamplingPlan{.strategies = *run.strategies};
  if (needs_pilot(settings)) {
    const Renderer renderer(setup.scene, settings, 1);
    settings.plan = run_pilot(
                        renderer, 1, [] { return true; }, kAutoPaths)
                        .chosen;
  }
  return render_batches(setup.scene, settings, kBatches);
}

/// Relative standard error, of the channel where it is largest.
double relative_error(const Setup& setup, const Batches& b) {
  double error = 0;
  for (int c = 0; c < 3; ++c) {
    const auto exact = setup.exact[static_cast<size_t>(c)];
    if (exact > 0) error = std::max(error, b.mean(c).standard_error / exact);
  }
  return error;
}

/// Samples that bring the error of `spp` samples to kGuidedError, as far as a row may have them.
int64_t enough_spp(const Setup& setup, double error, int64_t spp, const SuiteOptions& options) {
  const int64_t pixels = int64_t{setup.scene.film.width} * setup.scene.film.height;
  const int64_t most = std::max(largest_work(options) / pixels / kLeastSpp, int64_t{1}) * kLeastSpp;
  const double needed = std::ceil(std::pow(error / kGuidedError, 2) * static_cast<double>(spp) / kLeastSpp) *
                        static_cast<double>(kLeastSpp);
  return std::clamp(needed < static_cast<double>(most) ? static_cast<int64_t>(needed) : most, kLeastSpp,
                    most);
}

/// The row's render. If it is noisier than its pilot made believe, it is the pilot of another.
Batches render_row(const Setup& setup, const Run& run, const SuiteOptions& options, int64_t* spp) {
  const Batches pilot = render(setup, run, kLeastSpp, kPilotSeed);
  *spp = enough_spp(setup, relative_error(setup, pilot), kLeastSpp, options);
  Batches batches = render(setup, run, *spp, kSeed);
  const double error = relative_error(setup, batches);
  const int64_t more = enough_spp(setup, error, *spp, options);
  if (error <= kLargestError || more <= *spp) return batches;
  *spp = more;
  return render(setup, run, *spp, kSeed + 1);
}

Strategies set_of(const Run& run) {
  RenderSettings settings;
  settings.integrator = run.integrator;
  if (run.strategies) settings.plan = SamplingPlan{.strategies = *run.strategies};
  return strategies_of(settings);
}

const Note* note_for(const Case& subject, const Run& run) {
  for (const Note& n : subject.notes) {
    if (!(set_of(run) & n.needs)) return &n;
  }
  return nullptr;
}

}  // namespace

const char* verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::kPass:
      return "pass";
    case Verdict::kNoisy:
      return "noisy";
    case Verdict::kSkip:
      return "skip";
    case Verdict::kKnown:
      return "known";
    case Verdict::kFail:
      break;
  }
  return "FAIL";
}

Measurement measure_batches(const Batches& batches, const std::array<double, 3>& exact, double oracle_error) {
  Measurement worst;
  worst.z = -1;
  for (int c = 0; c < 3; ++c) {
    const Estimate e = batches.mean(c);
    Measurement m;
    m.channel = c;
    m.exact = exact[static_cast<size_t>(c)];
    m.measured = e.mean;
    m.standard_error = e.standard_error;
    const double error = std::hypot(e.standard_error, oracle_error * m.exact);
    const double off = e.mean - m.exact;
    const double t = off == 0 ? 0 : error > 0 ? off / error : HUGE_VAL;
    m.z = std::copysign(normal_deviate(student_two_sided(std::fabs(t), e.n - 1)), off);
    if (!std::isfinite(e.mean)) m.z = HUGE_VAL;
    if (c == 0 || std::fabs(m.z) > std::fabs(worst.z)) worst = m;
  }
  worst.effective_samples = effective_samples(batches, worst.channel);
  worst.nonfinite = batches.counters.nonfinite;
  worst.picture = mean_image(batches);
  return worst;
}

std::string row_title(const Case& subject, const Run& run) {
  return subject.name + ", " + subject.parameter + " [" + run.name + "]";
}

// The inverse of erfc by bisection.
double normal_deviate(double p) {
  double lo = 0, hi = 38;
  for (int i = 0; i < 200; ++i) {
    const double mid = 0.5 * (lo + hi);
    (std::erfc(mid / std::sqrt(2.0)) > p ? lo : hi) = mid;
  }
  return lo;
}

std::vector<Run> runs_that_see(const Sight& sight, bool every_set) {
  std::vector<Run> all{{"pt", Integrator::kPt}, {"lt", Integrator::kLt}, {"bdpt", Integrator::kBdpt}};
  for (Strategies set = 1; set <= kAllStrategies; ++set) {
    if (std::any_of(all.begin(), all.begin() + 3, [&](const Run& r) { return set_of(r) == set; })) continue;
    const bool single = (set & (set - 1)) == 0;
    if (every_set || single) all.push_back({strategy_names(set), Integrator::kBdpt, set});
  }
  std::erase_if(all, [&](const Run& run) { return !sight.covered_by(set_of(run)); });
  return all;
}

std::vector<Run> runs_of(const Case& subject, const SuiteOptions& options) {
  if (subject.full_only && !options.full) return {};
  std::vector<Run> runs;
  if (!subject.measure) {
    runs = runs_that_see(subject.sight, options.full || subject.every_set);
  } else if (subject.sight.covered_by(kAllStrategies)) {
    runs = {{"pt", Integrator::kPt}, {"lt", Integrator::kLt}, {"bdpt", Integrator::kBdpt}};
  } else {
    runs = {{"sums", Integrator::kPt}};
  }
  if (subject.pt_only && !options.full) runs.resize(1);
  std::erase_if(runs, [&](const Run& run) {
    return row_title(subject, run).find(options.filter) == std::string::npos;
  });
  return runs;
}

Row run_case(const Case& subject, const Run& run, const SuiteOptions& options) {
  Row row;
  row.subject = &subject;
  row.run = run;
  const Note* note = note_for(subject, run);
  if (note) row.note = note->why;
  if (note && note->kind == Note::kSkip) {
    row.verdict = Verdict::kSkip;
    return row;
  }
  if (subject.measure) {
    row.m = subject.measure(run.integrator);
  } else {
    const Setup setup = subject.build();
    row.m = measure_batches(render_row(setup, run, options, &row.spp), setup.exact, setup.oracle_error);
  }
  const bool sharp = row.m.standard_error <= kLargestError * std::fabs(row.m.exact) &&
                     (subject.measure || row.m.effective_samples >= kLeastEffective);
  const bool right = row.m.nonfinite == 0 && std::fabs(row.m.z) < options.largest_z;
  // A known miss excuses no value that is not finite.
  if (note && note->kind == Note::kKnown && row.m.nonfinite == 0 && !(right && sharp)) {
    row.verdict = Verdict::kKnown;
  } else if (!right) {
    row.verdict = Verdict::kFail;
  } else if (sharp) {
    row.verdict = Verdict::kPass;
    row.note.clear();
  } else if (!options.noisy_fails || (note && note->kind == Note::kNoisy)) {
    row.verdict = Verdict::kNoisy;
  } else {
    row.verdict = Verdict::kFail;
    row.note = "too noisy to tell";
  }
  return row;
}

}  // namespace lightmill::test
