// Denoised pictures of jobs: nobody waits for them, none is made twice, and large images are reduced.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

#include "common/image/denoise/denoise.h"
#include "coordinator/web/denoised/denoised_pictures.h"
#include "coordinator/web/film_mark.h"
#include "tests/common/image/denoise/noisy_picture.h"
#include "tests/coordinator/web/web_fixture.h"

namespace lightmill {
namespace {

using namespace testing;

JobId job_number(size_t number) { return JobId{"j" + std::to_string(number)}; }

TEST(Wishes, AreFewAndEachThereOnce) {
  Wishes wishes;
  EXPECT_FALSE(wishes.take());
  for (int i = 0; i < 3; ++i) wishes.add(job_number(1));
  EXPECT_EQ(wishes.size(), 1u);
  for (size_t i = 2; i <= Wishes::kMost + 1; ++i) wishes.add(job_number(i));
  EXPECT_EQ(wishes.size(), Wishes::kMost);
  for (size_t i = Wishes::kMost + 1; i > 1; --i)
    EXPECT_EQ(wishes.take(), job_number(i)) << "the newest first";
  EXPECT_TRUE(wishes.empty()) << "the oldest has gone";
  wishes.add(job_number(1));
  wishes.remove(job_number(1));
  EXPECT_FALSE(wishes.take());
}

TEST(Wishes, WhoAsksAllTheTimeKeepsNobodyFromATurn) {
  Wishes wishes;
  const auto ask = [&] {
    for (const size_t job : {3, 2, 1}) wishes.add(job_number(job));
  };
  for (int round = 0; round < 4; ++round) {
    for (const size_t job : {1, 2, 3}) {
      ask();
      EXPECT_EQ(wishes.take(), job_number(job));
    }
  }
  ask();
  wishes.add(job_number(4));
  ask();
  EXPECT_EQ(wishes.take(), job_number(4)) << "it has had none";
}

/// Colour and AOVs of a noisy picture as a job has them; `layers` are its features and its difference.
void as_job(const DenoiseInput& input, Image* image, ChannelImage* layers) {
  const auto pixels = static_cast<size_t>(input.width) * static_cast<size_t>(input.height);
  *image = Image(input.width, input.height);
  layers->channels = {"albedo.R", "albedo.G", "albedo.B",     "normal.X",     "normal.Y",
                      "normal.Z", "depth.Z",  "difference.R", "difference.G", "difference.B"};
  layers->image = Image(input.width, input.height, 10);
  for (size_t i = 0; i < pixels; ++i) {
    float* to = &layers->image.data[10 * i];
    for (size_t c = 0; c < 3; ++c) {
      image->data[3 * i + c] = input.colour[c][i];
      to[c] = input.albedo[c].values[i];
      to[3 + c] = input.normal[c].values[i];
      to[7 + c] = input.difference[c][i];
    }
    to[6] = input.depth.values[i];
  }
}

class DenoisedPictureTest : public ::testing::Test {
 protected:
  DenoisedPictureTest() { as_job(room.input, &image, &layers); }
  DenoisedPicture denoised(int64_t most_pixels) const {
    return denoised_picture(image, layers, most_pixels, {});
  }
  const NoisyPicture room = noisy_room(120, 90, 0.3);
  Image image;
  ChannelImage layers;
};

TEST_F(DenoisedPictureTest, IsWhatTheDenoiserMakesOfItsLayers) {
  const DenoisedPicture picture = denoised(120 * 90);
  const DenoiseResult result = denoise_picture(room.input, {.threads = 1});
  EXPECT_EQ(picture.layers, "difference,albedo,normal,depth");
  EXPECT_EQ(picture.block, 1);
  EXPECT_EQ(picture.relmse, result.relmse);
  EXPECT_EQ(picture.relmse_raw, result.relmse_raw);
  EXPECT_LT(picture.relmse, picture.relmse_raw / 2);
  for (size_t i = 0; i < picture.image->data.size(); ++i)
    ASSERT_EQ(picture.image->data[i], result.colour[i % 3][i / 3]) << i;
}

TEST_F(DenoisedPictureTest, IsReducedWithItsLayers) {
  const DenoisedPicture whole = denoised(120 * 90), small = denoised(120 * 90 - 1);
  EXPECT_EQ(small.block, 2);
  EXPECT_EQ(small.image->width, 60);
  EXPECT_EQ(small.image->height, 45);
  EXPECT_EQ(small.layers, whole.layers);
  // Means of four independent values have a quarter of the noise: the difference tells it.
  EXPECT_NEAR(small.relmse_raw, whole.relmse_raw / 4, whole.relmse_raw / 20);
  for (const int64_t most : {60 * 45 - 1, 100, 2, 1, 0}) {
    const DenoisedPicture smaller = denoised(most);
    EXPECT_LE(int64_t{smaller.image->width} * smaller.image->height, std::max<int64_t>(most, 1));
    EXPECT_EQ(smaller.image->width, (120 + smaller.block - 1) / smaller.block);
  }
}

TEST_F(DenoisedPictureTest, WithoutLayersTheColourAloneGuides) {
  const DenoisedPicture picture = denoised_picture(image, {}, 120 * 90, {});
  EXPECT_EQ(picture.layers, "");
  EXPECT_LT(picture.relmse, picture.relmse_raw);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(denoised_picture(image, {}, 120 * 90, stop.get_token()), DenoiseStopped);
}

class DenoisedPicturesTest : public WebApiTest {
 protected:
  JobId rendered(int64_t spp = 4) {
    const JobId job = farm.submit(small_job(96, 64, spp, Integrator::kPt));
    work(farm, farm.register_worker(registration()));
    return job;
  }
  httplib::Result ask(const JobId& job, const httplib::Headers& headers = {}) {
    return http.Get("/api/v1/jobs/" + job.value + "/denoised", headers);
  }
  /// Asks until it shows all that the job has; the thread that makes it takes its time.
  httplib::Result newest(const JobId& job) {
    for (;;) {
      httplib::Result answer = ask(job);
      if (!answer || (answer->status != 204 && !answer->has_header("X-Lightmill-Stale"))) return answer;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
};

TEST_F(DenoisedPicturesTest, AreThereAWhileAfterTheyWereAskedFor) {
  const JobId empty = farm.submit(small_job(64, 64, 4, Integrator::kPt));
  EXPECT_EQ(ask(empty)->status, 204);
  farm.cancel(empty);
  const JobId job = rendered();
  EXPECT_EQ(ask(job)->status, 204) << "nobody waits";
  const auto first = newest(job);
  ASSERT_TRUE(first);
  ASSERT_EQ(first->status, 200) << first->body;
  ASSERT_EQ(first->body.size(), 16u + 2 * 3 * 96 * 64);
  EXPECT_EQ(first->body.substr(0, 4), "LMH1");
  uint32_t head[3];
  std::memcpy(head, first->body.data() + 4, sizeof head);
  EXPECT_THAT(head, ::testing::ElementsAre(96u, 64u, 3u));
  EXPECT_NE(first->body, http.Get("/api/v1/jobs/" + job.value + "/image")->body);
  EXPECT_EQ(first->get_header_value("X-Lightmill-Block"), "1");
  EXPECT_FALSE(first->has_header("X-Lightmill-Layers")) << "the job records none";
  const double relmse = std::stod(first->get_header_value("X-Lightmill-Relmse"));
  const double raw = std::stod(first->get_header_value("X-Lightmill-Relmse-Raw"));
  EXPECT_GT(raw, 0);
  EXPECT_GE(relmse, 0);
  const std::string path = "/api/v1/jobs/" + job.value + "/denoised";
  EXPECT_EQ(http.Get(path + "?side=48")->body.size(), 16u + 2 * 3 * 48 * 32);
  EXPECT_EQ(http.Get(path + "?side=x")->status, 400);
  get("/api/v1/jobs/j404/denoised", 404);
}

TEST_F(DenoisedPicturesTest, AreMadeAnewOnlyWhenTheJobHasGotOn) {
  const JobId job = rendered();
  const auto first = newest(job);
  const std::string tag = first->get_header_value("ETag");
  EXPECT_EQ(tag, "\"" + film_mark(farm.job(job)) + "\"");
  EXPECT_EQ(newest(job)->body, first->body);
  farm.extend(job, 8, {}, {});  // another version of the job, and the same film
  const auto same = ask(job, {{"If-None-Match", tag}});
  EXPECT_EQ(same->status, 304);
  EXPECT_TRUE(same->body.empty());
  EXPECT_FALSE(same->has_header("X-Lightmill-Stale"));
  EXPECT_TRUE(same->has_header("X-Lightmill-Relmse"));
  work(farm, farm.register_worker(registration()));
  const auto shown = ask(job);
  ASSERT_EQ(shown->status, 200) << "shown until there is a newer one";
  EXPECT_EQ(shown->body, first->body);
  EXPECT_TRUE(shown->has_header("X-Lightmill-Stale"));
  const auto next = newest(job);
  EXPECT_NE(next->body, first->body);
  EXPECT_NE(next->get_header_value("ETag"), tag);
}

TEST_F(DenoisedPicturesTest, OfLargeImagesAreReduced) {
  Pictures pictures(farm);
  DenoisedPictures denoised(farm, pictures, 96 * 64 / 4);
  const JobId job = rendered();
  EXPECT_FALSE(denoised.get(job));
  std::optional<DenoisedPictures::Answer> answer;
  while (!(answer = denoised.get(job))) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(answer->picture.block, 2);
  EXPECT_EQ(answer->picture.image->width, 48);
  EXPECT_EQ(answer->picture.image->height, 32);
  EXPECT_TRUE(answer->current);
  EXPECT_EQ(pictures.kept(job), answer->picture.image);
  EXPECT_EQ(denoised.get(job)->picture.image, answer->picture.image) << "the same one";
}

TEST_F(DenoisedPicturesTest, AreForgottenWithinTheBytesOfAllPictures) {
  Pictures pictures(farm);
  const auto large = std::make_shared<const Image>(4096, 4096);  // 192 MiB
  pictures.keep(job_number(1), large);
  EXPECT_EQ(pictures.kept(job_number(1)), large);
  pictures.keep(job_number(2), std::make_shared<const Image>(1024, 1024));
  EXPECT_TRUE(pictures.kept(job_number(1)));
  pictures.keep(job_number(3), large);
  EXPECT_FALSE(pictures.kept(job_number(2))) << "the least recently used";
  EXPECT_FALSE(pictures.kept(job_number(1)));
  EXPECT_TRUE(pictures.kept(job_number(3)));
}

}  // namespace
}  // namespace lightmill
