// A scene that comes over HTTP, file by file, as a browser sends it.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "common/base/digest.h"
#include "common/scene/load.h"
#include "coordinator/web/web_api.h"
#include "tests/coordinator/web/web_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kMain = R"(Film "rgb" "integer xresolution" 64 "integer yresolution" 48
Sampler "sobol" "integer pixelsamples" 9
WorldBegin
LightSource "infinite"
Include "parts/ball.pbrt"
)";
constexpr const char* kBall = R"(Material "diffuse"
Shape "plymesh" "string filename" "../meshes/t.ply"
)";
constexpr const char* kMesh = R"(ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 1
1 0 1
0 1 1
3 0 1 2
)";

class SceneSubmitTest : public WebApiTest {
 protected:
  /// Sends a file in pieces of `piece` bytes and returns its entry of a scene.
  json upload(const std::string& name, const std::string& text, size_t piece = 100) {
    const std::string digest = sha256_hex(text);
    json said;
    for (size_t at = 0; at < text.size() || at == 0; at += piece) {
      const auto response =
          http.Put("/api/v1/blobs/" + digest + "?size=" + std::to_string(text.size()) +
                       "&offset=" + std::to_string(at),
                   {{"X-Lightmill", "1"}}, text.substr(at, piece), "application/octet-stream");
      EXPECT_TRUE(response && response->status == 200) << (response ? response->body : "no answer");
      if (!response) return {};
      said = json::parse(response->body);
    }
    EXPECT_EQ(said, json({{"received", text.size()}, {"complete", true}}));
    return {{"name", name}, {"digest", digest}, {"size", text.size()}};
  }
  json scene(const std::vector<json>& files) { return {{"main", "scene.pbrt"}, {"files", files}}; }
};

TEST_F(SceneSubmitTest, AsksForWhatIsMissingUntilItIsAJob) {
  const json main = upload("scene.pbrt", kMain);
  json said = post("/api/v1/scene/check", scene({main}));
  EXPECT_EQ(said["missing"], json::array({{{"name", "parts/ball.pbrt"}, {"reference", "parts/ball.pbrt"}}}));
  ASSERT_EQ(said["errors"].size(), 1u);
  EXPECT_THAT(std::string(said["errors"][0]), HasSubstr("scene.pbrt:5:"));
  EXPECT_THAT(std::string(post("/api/v1/scene/submit", scene({main}), 400)["error"]),
              HasSubstr("parts/ball.pbrt"));

  const json ball = upload("parts/ball.pbrt", kBall);
  said = post("/api/v1/scene/check", scene({main, ball}));
  ASSERT_EQ(said["missing"].size(), 1u) << said;
  const std::string reference = said["missing"][0]["reference"], name = said["missing"][0]["name"];
  EXPECT_EQ(reference, "../meshes/t.ply") << "above the scene's folder";
  EXPECT_THAT(name, ::testing::StartsWith("external/"));

  const json mesh = upload(name, kMesh), other = upload("notes.txt", "not of the scene");
  json body = scene({main, ball, mesh, other});
  said = post("/api/v1/scene/check", body);
  EXPECT_EQ(said["errors"], json::array());
  EXPECT_EQ(said["missing"], json::array());
  EXPECT_EQ(said["files"], 3) << "what the scene does not use stays out";
  EXPECT_EQ(said["width"], 64);
  EXPECT_EQ(said["spp"], 9);
  EXPECT_EQ(farm.jobs().size(), 0u) << "a check makes nothing";

  body.update({{"name", "from a browser"},
               {"spp", 33},
               {"max_depth", 0},
               {"width", 32},
               {"height", 24},
               {"integrator", "pt"},
               {"priority", 4},
               {"seed", 5},
               {"aovs", "albedo"}});
  const json row = post("/api/v1/scene/submit", body)["job"];
  const JobStatus job = farm.job(JobId{row["id"]});
  EXPECT_EQ(job.name, "from a browser");
  EXPECT_EQ(job.priority, 4);
  EXPECT_EQ(job.settings.spp, 33);
  EXPECT_EQ(job.settings.max_depth, kUnlimitedDepth);
  EXPECT_EQ(job.settings.grid.width, 32);
  EXPECT_EQ(job.settings.integrator, Integrator::kPt);
  EXPECT_EQ(job.settings.seed, 5u);
  EXPECT_NE(job.settings.aovs, 0u);
  const Bundle bundle = farm.bundle(job.bundle_digest);
  std::vector<std::string> names;
  for (const BundleEntry& entry : bundle.entries) names.push_back(entry.name);
  EXPECT_THAT(names, ElementsAre(name, "parts/ball.pbrt", "scene.pbrt"));
  EXPECT_THAT(events.after(0).back().text, HasSubstr("submitted by a browser at 127.0.0.1"));
}

TEST_F(SceneSubmitTest, IsTheBundleThatAClientMakes) {
  namespace fs = std::filesystem;
  const fs::path at = folder.file("project");
  fs::create_directories(at / "parts");
  std::ofstream(at / "scene.pbrt") << kMain;
  std::ofstream(at / "parts/ball.pbrt") << "Shape \"sphere\"\n";
  const SceneDescription loaded = load_scene_file((at / "scene.pbrt").string(), {}, {});
  const Bundle wanted = make_bundle(loaded, nullptr);
  const json row =
      post("/api/v1/scene/submit",
           scene({upload("scene.pbrt", kMain), upload("parts/ball.pbrt", "Shape \"sphere\"\n")}))["job"];
  EXPECT_EQ(farm.job(JobId{row["id"]}).bundle_digest, wanted.digest());
}

TEST_F(SceneSubmitTest, ProblemsAreLinesOfTheScene) {
  const json main = upload("scene.pbrt", "WorldBegin\nShape \"sphear\"\nMaterial \"golden\"\n");
  const json said = post("/api/v1/scene/check", scene({main}));
  ASSERT_GE(said["errors"].size() + said["warnings"].size(), 1u);
  EXPECT_THAT(said["errors"].dump() + said["warnings"].dump(), HasSubstr("scene.pbrt:2:"));
}

TEST_F(SceneSubmitTest, NamesAndSizesAreWhatTheySay) {
  const json main = upload("scene.pbrt", kMain);
  for (const char* name : {"../scene.pbrt", "/etc/passwd", "a/../../b", "a//b", "", "a\nb", "."}) {
    json files = {main, {{"name", name}, {"digest", main["digest"]}, {"size", main["size"]}}};
    post("/api/v1/scene/check", scene(files), 400);
    post("/api/v1/scene/submit", scene(files), 400);
  }
  post("/api/v1/scene/check", scene({main, main}), 400);  // twice
  json wrong = main;
  wrong["size"] = 7;
  post("/api/v1/scene/check", scene({wrong}), 400);
  wrong["size"] = -7;
  post("/api/v1/scene/check", scene({wrong}), 400);
  wrong = main;
  wrong["digest"] = "../../../etc/passwd";
  post("/api/v1/scene/check", scene({wrong}), 400);
  wrong["digest"] = sha256_hex("not here");
  EXPECT_THAT(std::string(post("/api/v1/scene/check", scene({wrong}), 409)["error"]),
              HasSubstr("was not uploaded"));
  post("/api/v1/scene/check", {{"main", "other.pbrt"}, {"files", {main}}}, 400);
  post("/api/v1/scene/check", {{"main", "scene.pbrt"}, {"files", "all"}}, 400);
  json typo = scene({main});
  typo["sppp"] = 5;
  post("/api/v1/scene/submit", typo, 400);
  typo = scene({main});
  typo["integrator"] = "magic";
  post("/api/v1/scene/submit", typo, 400);
  EXPECT_EQ(farm.jobs().size(), 0u);
  // A scene can't reach the coordinator's own files.
  const json thief = upload("scene.pbrt", "WorldBegin\nInclude \"/etc/passwd\"\n");
  const json said = post("/api/v1/scene/check", scene({thief}));
  EXPECT_EQ(said["missing"][0]["reference"], "/etc/passwd");
  EXPECT_EQ(said.dump().find("root:"), std::string::npos);
}

TEST_F(SceneSubmitTest, QuotasHoldHereToo) {
  const auto large = http.Put("/api/v1/blobs/" + sha256_hex("x") + "?size=5000000&offset=0",
                              {{"X-Lightmill", "1"}}, "x", "application/octet-stream");
  ASSERT_TRUE(large);
  EXPECT_EQ(large->status, 429);
  EXPECT_THAT(large->body, HasSubstr("--max-bundle-mb"));
  const auto piece =
      http.Put("/api/v1/blobs/" + sha256_hex("x") + "?size=2000000&offset=0", {{"X-Lightmill", "1"}},
               std::string(WebApi::kMaxBody + 1, 'x'), "application/octet-stream");
  EXPECT_TRUE(!piece || piece->status == 413) << piece->status;
  http.stop();
  const std::string part(3 << 20, 'a');
  const json main = upload("scene.pbrt", "WorldBegin\nLightSource \"infinite\"\n");
  const json a = upload("a.bin", part, 1 << 20), b = upload("b.bin", part + "b", 1 << 20);
  EXPECT_THAT(std::string(post("/api/v1/scene/check", scene({main, a, b}), 429)["error"]),
              HasSubstr("larger than the 4194304 bytes"));
  json wide = scene({main});
  wide.update({{"width", 2048}, {"height", 1024}});
  EXPECT_THAT(std::string(post("/api/v1/scene/submit", wide, 429)["error"]), HasSubstr("--max-pixels"));
  EXPECT_EQ(farm.jobs().size(), 0u);
}

TEST_F(SceneSubmitTest, OtherSitesCanSendNothing) {
  const std::string path = "/api/v1/blobs/" + sha256_hex("x") + "?size=1&offset=0";
  const httplib::Headers foreign = {{"X-Lightmill", "1"}, {"Origin", "http://evil.example"}};
  EXPECT_EQ(http.Put(path, {}, "x", "application/octet-stream")->status, 403);
  EXPECT_EQ(http.Put(path, foreign, "x", "application/octet-stream")->status, 403);
  EXPECT_FALSE(blobs.contains(sha256_hex("x")));
  const json main = upload("scene.pbrt", kMain);
  for (const char* what : {"check", "submit"}) {
    post(std::string("/api/v1/scene/") + what, scene({main}), 403, {});
    post(std::string("/api/v1/scene/") + what, scene({main}), 403, foreign);
  }
  const auto unknown = http.Put("/api/v1/blobs/..%2f..%2fescape?size=1&offset=0", {{"X-Lightmill", "1"}}, "x",
                                "application/octet-stream");
  EXPECT_THAT(unknown->status, ::testing::AnyOf(400, 404));
}

}  // namespace
}  // namespace lightmill
