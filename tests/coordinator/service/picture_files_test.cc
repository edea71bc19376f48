// Images as files that are sent in chunks.
#include "coordinator/service/streams/picture_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>

#include "common/base/error.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

using ::testing::ElementsAre;

std::shared_ptr<ImageAnswer> picture(int width, int height, const std::vector<std::string>& aovs) {
  auto answer = std::make_shared<ImageAnswer>();
  answer->image = Image(width, height);
  for (size_t i = 0; i < answer->image.data.size(); ++i) answer->image.data[i] = static_cast<float>(i);
  answer->aovs.channels = aovs;
  answer->aovs.image.width = width;
  answer->aovs.image.height = height;
  answer->aovs.image.channels = static_cast<int>(aovs.size());
  answer->aovs.image.data.resize(static_cast<size_t>(width * height) * aovs.size());
  for (size_t i = 0; i < answer->aovs.image.data.size(); ++i)
    answer->aovs.image.data[i] = -static_cast<float>(i);
  answer->metadata["job"] = "j1";
  return answer;
}

v1::GetPictureRequest asked(const std::string& format) {
  v1::GetPictureRequest request;
  request.set_job_id("j1");
  request.set_format(format);
  return request;
}

/// All chunks together; the first one's head goes to `first`.
std::string received(std::shared_ptr<ImageAnswer> answer, const v1::GetPictureRequest& request,
                     v1::FileChunk* first) {
  AnswerMemory memory(uint64_t{1} << 30, [] {});
  const auto source = picture_chunks(std::move(answer), PictureForm(request), memory);
  std::string bytes;
  v1::FileChunk chunk;
  for (bool begun = false; source(&chunk); begun = true) {
    if (!begun) *first = chunk;
    EXPECT_EQ(begun, chunk.content_type().empty());
    EXPECT_LE(chunk.content().size(), kSentChunkBytes);
    bytes += chunk.content();
  }
  EXPECT_EQ(first->file_size(), bytes.size());
  return bytes;
}

TEST(PictureFiles, WhatMattesAreGoesBeforeThePixels) {
  const auto answer = picture(5, 3, {"CryptoObject00.r"});
  const std::string manifest(3 * kSentChunkBytes + 7, 'm');
  answer->aovs.attributes = {{"cryptomatte/3ae39a5/manifest", manifest},
                             {"cryptomatte/3ae39a5/name", "CryptoObject"}};
  const auto source = chunks_of(answer);
  std::map<std::string, std::string> attributes;
  size_t headers = 0, pixel_bytes = 0;
  v1::FetchImageResponse message;
  while (source(&message)) {
    headers += message.has_header();
    pixel_bytes += message.chunk().size();
    if (!message.has_attribute()) continue;
    EXPECT_EQ(pixel_bytes, 0u);
    EXPECT_LE(message.attribute().text().size(), kSentChunkBytes);
    attributes[message.attribute().name()] += message.attribute().text();
  }
  EXPECT_EQ(headers, 1u);
  EXPECT_EQ(attributes, answer->aovs.attributes);
  EXPECT_EQ(pixel_bytes, 5u * 3 * 4 * sizeof(float));
}

TEST(PictureFiles, RawIsNamesAndInterleavedFloats) {
  const auto answer = picture(150, 90, {"albedo.R", "depth.Z"});
  v1::FileChunk first;
  const std::string bytes = received(answer, asked("raw"), &first);
  EXPECT_EQ(first.file_name(), "j1.raw");
  ASSERT_EQ(bytes.substr(0, 4), "LMF2");
  uint32_t head[4];
  std::memcpy(head, bytes.data() + 4, sizeof head);
  const std::string names = "R\nG\nB\nalbedo.R\ndepth.Z";
  EXPECT_THAT(head, ElementsAre(150u, 90u, 5u, names.size()));
  EXPECT_EQ(bytes.substr(20, names.size()), names);
  std::vector<float> values(size_t{150} * 90 * 5);
  ASSERT_EQ(bytes.size(), 20 + names.size() + 4 * values.size());
  std::memcpy(values.data(), bytes.data() + 20 + names.size(), 4 * values.size());
  for (size_t pixel = 0; pixel < size_t{150} * 90; ++pixel) {
    for (size_t c = 0; c < 3; ++c)
      ASSERT_EQ(values[5 * pixel + c], static_cast<float>(3 * pixel + c)) << pixel;
    for (size_t c = 0; c < 2; ++c)
      ASSERT_EQ(values[5 * pixel + 3 + c], -static_cast<float>(2 * pixel + c)) << pixel;
  }
}

TEST(PictureFiles, ExrHasLayersAndMetadata) {
  test::TemporaryFolder folder;
  v1::FileChunk first;
  const std::string bytes =
      received(picture(200, 100, {"albedo.R", "albedo.G", "albedo.B"}), asked(""), &first);
  EXPECT_EQ(first.content_type(), "image/x-exr");
  const std::string path = folder.file("j1.exr");
  std::ofstream(path, std::ios::binary) << bytes;
  const Image read = read_image(path);
  EXPECT_EQ(read.width, 200);
  EXPECT_EQ(read.data, picture(200, 100, {})->image.data);
  EXPECT_NE(bytes.find("albedo.R"), std::string::npos);
}

TEST(PictureFiles, PngIsAsItIsShown) {
  v1::FileChunk first;
  v1::GetPictureRequest request = asked("png");
  const std::string plain = received(picture(20, 10, {}), request, &first);
  EXPECT_EQ(first.content_type(), "image/png");
  EXPECT_EQ(plain.substr(1, 3), "PNG");
  request.set_view("aces");
  request.set_exposure(-8);
  EXPECT_NE(received(picture(20, 10, {}), request, &first), plain);
}

TEST(PictureFiles, AnImageWithoutPixelsIsNoFile) {
  v1::FileChunk first;
  const std::string raw = received(picture(0, 0, {}), asked("raw"), &first);
  EXPECT_EQ(raw.size(), 25u);
  EXPECT_THROW(received(picture(0, 0, {}), asked("png"), &first), Error);
}

}  // namespace
}  // namespace lightmill
