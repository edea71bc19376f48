// The error of the denoised image: on the curve, and as what a job stops by. Time is simulated, but for the
// wait for the thread that estimates it.
#include "coordinator/core/farm.h"
#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

class DenoisedError : public FarmFixture {
 protected:
  static JobRequest to_denoise(int64_t spp) {
    JobRequest request = small_job(64, 64, spp, Integrator::kPt);
    request.settings.aovs = kAovsToDenoise;
    return request;
  }
  static JobRequest with_target(double target) {
    JobRequest request = to_denoise(100000);
    request.settings.target_error = target;
    request.settings.target_denoised = true;
    return request;
  }
  /// Waits for the next change of the job after `status`.
  JobStatus next(const JobStatus& status) const { return farm.wait(status.id, status.version, 60); }
  /// Renders until the job ends; the estimates come from another thread.
  JobStatus render(const JobId& job) {
    const WorkerId ann = farm.register_worker(registration());
    JobStatus status = farm.job(job);
    while (!is_final(status.state)) {
      if (work(farm, ann) == 0 && !is_final(farm.job(job).state)) status = next(status);
      status = farm.job(job);
    }
    return status;
  }
};

TEST_F(DenoisedError, IsOnTheCurveOfAJobThatRecordsWhatDenoisingTakes) {
  const JobId job = farm.submit(to_denoise(32));
  work(farm, farm.register_worker(registration()));
  JobStatus status = farm.job(job);
  EXPECT_EQ(status.state, JobState::kDone) << "it does not wait for that";
  while (!status.denoised_relmse) status = next(status);
  const std::vector<ErrorPoint> points = farm.curve(job).points;
  EXPECT_EQ(points.back().spp, 32);
  EXPECT_EQ(points.back().denoised_relmse, status.denoised_relmse);
  ASSERT_TRUE(points.back().denoised_relmse_low && points.back().denoised_relmse_high);
  EXPECT_LE(*points.back().denoised_relmse_low, *points.back().denoised_relmse);
  EXPECT_GE(*points.back().denoised_relmse_high, *points.back().denoised_relmse);
  EXPECT_TRUE(points.back().relmse) << "beside that of the raw image";
  EXPECT_LT(*points.back().denoised_relmse, *points.back().relmse) << "the picture is noise on one colour";
  for (size_t i = 1; i < points.size(); ++i) EXPECT_LT(points[i - 1].spp, points[i].spp) << "each once";
}

TEST_F(DenoisedError, StopsAJobAtTheFirstDoublingThatMeetsTheTarget) {
  const JobId job = farm.submit(with_target(1e-3));
  const JobStatus status = render(job);
  EXPECT_EQ(status.state, JobState::kDone);
  ASSERT_TRUE(status.denoised_relmse_high);
  EXPECT_LT(*status.denoised_relmse_high, 1e-3);
  double doubling = 32;
  for (const ErrorPoint& p : farm.curve(job).points) {
    if (!p.denoised_relmse) continue;
    EXPECT_EQ(p.spp, doubling);
    EXPECT_EQ(meets_target(p, 1e-3, true), p.spp == status.spp);
    doubling *= 2;
  }
  EXPECT_EQ(status.spp, doubling / 2) << "nothing was rendered beyond";
  auto settings = with_target(1e-3).settings;
  settings.spp = static_cast<int64_t>(status.spp);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(settings)));
}

TEST_F(DenoisedError, TheRawErrorStopsNoJobWhoseTargetIsDenoised) {
  JobRequest request = with_target(1e-30);
  request.settings.spp = 64;
  const JobStatus status = render(farm.submit(request));
  EXPECT_EQ(status.spp, 64);
  EXPECT_GT(*status.denoised_relmse_high, 1e-30);
}

TEST_F(DenoisedError, WantsLayersAndAnImageThatIsNotTooLarge) {
  JobRequest request = with_target(0.01);
  request.settings.aovs = kAovDifference;
  EXPECT_THAT(error_of([&] { farm.submit(request); }), HasSubstr("--aov denoise"));
  request = with_target(0.01);
  request.settings.grid = {4096, 4096, {0, 0, 4096, 4096}};
  EXPECT_THAT(error_of([&] { farm.submit(request); }), HasSubstr("pixels"));
}

// The estimate of a coordinator that died is made again.
TEST_F(DenoisedError, IsEstimatedAfterARestart) {
  MemoryJobStore kept;
  JobId job;
  {
    Farm first(std::make_unique<WatchedStore>(kept, [](int) {}), clock, fake_options());
    job = first.submit(with_target(1e-30));
    const WorkerId ann = first.register_worker(registration());
    while (first.job(job).spp < 32) ASSERT_EQ(work(first, ann, 1), 1);
  }
  Farm second(std::make_unique<WatchedStore>(kept, [](int) {}), clock, fake_options());
  JobStatus status = second.job(job);
  second.tick();
  while (!status.denoised_relmse) status = second.wait(job, status.version, 60);
  EXPECT_GT(work(second, second.register_worker(registration()), 1), 0) << "and it goes on";
}

}  // namespace
}  // namespace lightmill
