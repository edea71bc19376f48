// Scenes are read in a process that may hang, crash or be taken over, and nothing comes of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "coordinator/scene/reader_process.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;

class SceneReadingTest : public ::testing::Test {
 protected:
  SceneQuestion question(const std::string& text) {
    const std::string path = folder.file("blob");
    std::ofstream(path) << text;
    SceneQuestion asked;
    asked.files.main = "scene.pbrt";
    asked.files.entries = {{"scene.pbrt", sha256_hex(text), text.size()}};
    asked.paths = {path};
    return asked;
  }
  /// What it is refused with; empty if it is not.
  static std::string refusal(const ReaderProcess& reader, const SceneQuestion& asked) {
    try {
      reader.read(asked);
      return "";
    } catch (const Error& e) {
      return e.what();
    }
  }
  static SceneAnswer really(const std::string& memory, const SceneQuestion& asked) {
    return ReaderProcess({COORDINATOR, "read-scene", "--memory", memory}, {}).read(asked);
  }
  test::TemporaryFolder folder;
};

TEST_F(SceneReadingTest, TheProcessSaysWhatTheReaderSays) {
  for (const char* text : {"Film \"rgb\" \"integer xresolution\" 70\nWorldBegin\nLightSource \"infinite\"\n",
                           "WorldBegin\nShape \"sphear\"\n", "Include \"other.pbrt\"\n", "\xff\xfe", ""}) {
    SceneQuestion asked = question(text);
    asked.options.spp = 77;
    asked.options.time_s = 12.5;
    EXPECT_EQ(answer_to_json(really("1000000000", asked)), answer_to_json(read_scene(asked))) << text;
  }
  SceneQuestion asked = question("WorldBegin\nLightSource \"infinite\"\n");
  asked.options.spp = 77;
  EXPECT_EQ(read_scene(asked).settings.spp, 77);
  asked.options.integrator = "magic";
  EXPECT_THAT(refusal(ReaderProcess({COORDINATOR, "read-scene", "--memory", "1000000000"}, {}), asked),
              HasSubstr("magic"));
}

TEST_F(SceneReadingTest, ALargeSceneDoesNotTakeTheMachine) {
  std::string text = "WorldBegin\nShape \"trianglemesh\" \"point3 P\" [";
  for (int i = 0; i < 6'000'000; ++i) text += "1 ";
  const SceneQuestion asked = question(text + "]\n");
  const SceneAnswer answer = really("80000000", asked);
  ASSERT_EQ(answer.errors.size(), 1u);
  EXPECT_THAT(answer.errors[0], HasSubstr("does not fit into memory"));
}

TEST_F(SceneReadingTest, ProcessesThatMisbehaveAreAnswers) {
  const SceneQuestion asked = question("WorldBegin\n");
  const auto with = [&](std::vector<std::string> command) {
    return refusal(ReaderProcess(std::move(command), {.memory_bytes = 0, .seconds = 0.5}), asked);
  };
  EXPECT_THAT(with({"/bin/sleep", "1000"}), HasSubstr("took more than"));
  EXPECT_THAT(with({"/bin/sh", "-c", "exec >&- <&-; exec sleep 1000"}), HasSubstr("ended with signal 9"));
  EXPECT_THAT(with({"/bin/false"}), HasSubstr("ended with status 1"));
  EXPECT_THAT(with({"/bin/sh", "-c", "kill -SEGV $$"}), HasSubstr("ended with signal 11"));
  EXPECT_THAT(with({"/bin/echo", "nonsense"}), HasSubstr("malformed"));
  EXPECT_THAT(with({"/bin/echo", "{\"errors\": [], \"warnings\": [], \"missing\": []}"}),
              HasSubstr("malformed"));
  EXPECT_THAT(with({"/no/such/program"}), HasSubstr("no process can be started"));
  EXPECT_THAT(with({"/bin/cat", "/dev/zero"}), HasSubstr("lightmill submit"));
}

TEST_F(SceneReadingTest, AShutdownWaitsForNoScene) {
  const SceneQuestion asked = question("WorldBegin\n");
  ReaderProcess reader({"/bin/sleep", "1000"}, {.memory_bytes = 0, .seconds = 1000});
  std::string said;
  std::thread reading([&] { said = refusal(reader, asked); });
  reader.stop();
  reading.join();
  EXPECT_THAT(said, HasSubstr("shutting down"));
}

TEST_F(SceneReadingTest, AnAnswerCanNotAddFiles) {
  const SceneQuestion asked = question("WorldBegin\nLightSource \"infinite\"\n");
  SceneAnswer lie = read_scene(asked);
  lie.bundle.entries.push_back({"secret", sha256_hex("secret"), 6});
  EXPECT_EQ(answer_from_json(answer_to_json(lie), asked).bundle.entries, asked.files.entries);
  lie.bundle.environment = "secret";
  EXPECT_THROW(answer_from_json(answer_to_json(lie), asked), Error);
}

}  // namespace
}  // namespace lightmill
