// Bad scenes at the command line: one line that says where, exit code 2, for check and render alike.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/image/image.h"
#include "tests/client/cli_fixture.h"

namespace lightmill::client {
namespace {

using ::testing::HasSubstr;
using testing::kBox;
using testing::Outcome;

struct BadScene {
  const char* name;
  std::string text;
  std::string says;         // part of the message, with its line where there is one
  bool is_warning = false;  // it renders all the same, unless --strict
};

class BadSceneTest : public testing::CliTest, public ::testing::WithParamInterface<BadScene> {};

TEST_P(BadSceneTest, IsRefusedWithItsPlace) {
  write("bad.pbrt", GetParam().text);
  if (GetParam().is_warning) {
    const Outcome outcome = run({"check", "bad.pbrt"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr(GetParam().says));
  }
  for (const char* verb : {"check", "render"}) {
    std::vector<std::string> arguments = {verb, "bad.pbrt", "--quiet"};
    if (GetParam().is_warning) arguments.push_back("--strict");
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2) << verb;
    EXPECT_EQ(lines(outcome.err), 1) << verb << ": " << outcome.err;
    EXPECT_THAT(outcome.out + outcome.err, HasSubstr(GetParam().says)) << verb;
  }
}

std::string box_and(const std::string& more) { return kBox + more; }  // `more` begins on line 12

INSTANTIATE_TEST_SUITE_P(
    Scenes, BadSceneTest,
    ::testing::Values(
        BadScene{"Empty", "", "bad.pbrt:"},
        BadScene{"Binary", std::string("\x7f\x45\x00\x01\xff", 5), "bad.pbrt:1:"},
        BadScene{"Truncated", std::string(kBox).substr(0, 420), "bad.pbrt:"},
        BadScene{"UnknownDirective", box_and("Shap \"sphere\"\n"), "bad.pbrt:12:1", true},
        BadScene{"UnknownShape", box_and("Shape \"sphear\"\n"), "bad.pbrt:12:", true},
        BadScene{"UnknownMaterial", box_and("Material \"difuse\"\n"), "bad.pbrt:12:", true},
        BadScene{"UnknownParameter", box_and("Shape \"sphere\" \"float radios\" 1\n"), "bad.pbrt:12:", true},
        BadScene{"WrongParameterType", box_and("Shape \"sphere\" \"string radius\" \"big\"\n"),
                 "bad.pbrt:12:", true},
        BadScene{"UnbalancedAttribute", box_and("AttributeBegin\n"), "bad.pbrt:"},
        BadScene{"SingularTransform", box_and("Scale 0 1 1\nShape \"sphere\"\n"), "bad.pbrt:1"},
        BadScene{
            "NanVertex",
            box_and(
                "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 nan 1 0] \"integer indices\" [0 1 2]\n"),
            "bad.pbrt:12:", true},
        BadScene{
            "IndexOutOfRange",
            box_and("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 9]\n"),
            "bad.pbrt:12:", true},
        BadScene{"MissingMesh", box_and("Shape \"plymesh\" \"string filename\" \"none.ply\"\n"), "none.ply"},
        BadScene{"MissingTexture",
                 box_and("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"none.png\"\n"),
                 "none.png"},
        BadScene{"MissingInclude", box_and("Include \"none.pbrt\"\n"), "none.pbrt"},
        BadScene{"ZeroResolution",
                 "Film \"rgb\" \"integer xresolution\" 0 \"integer yresolution\" 64\nWorldBegin\n",
                 "bad.pbrt:", true},
        BadScene{"HugeResolution",
                 "Film \"rgb\" \"integer xresolution\" 100000 \"integer yresolution\" 100000\nWorldBegin\n"
                 "LightSource \"infinite\"\nShape \"sphere\"\n",
                 "bad.pbrt:"},
        BadScene{"NegativeSamples", "Sampler \"sobol\" \"integer pixelsamples\" -4\nWorldBegin\n",
                 "bad.pbrt:1:", true}),
    [](const auto& info) { return info.param.name; });

class BadMesh : public testing::CliTest {};

TEST_F(BadMesh, TruncatedAndMalformedMeshesAreRefused) {
  write("bad.pbrt", box_and("Shape \"plymesh\" \"string filename\" \"m.ply\"\n"));
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const std::string& mesh :
       {std::string(""), std::string("plx\n"), header.substr(0, 60), header, header + "0 0 0\n1 0 0\n0 1 0\n",
        header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", header + "0 0 0\n1 0 inf\n0 1 0\n3 0 1 2\n"}) {
    write("m.ply", mesh);
    const Outcome outcome = run({"render", "bad.pbrt", "--quiet"});
    EXPECT_EQ(outcome.code, 2) << mesh;
    EXPECT_EQ(lines(outcome.err), 1) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("m.ply")) << mesh;
  }
}

TEST_F(BadMesh, AZeroAreaTriangleDoesNoHarm) {
  write("ok.pbrt",
        box_and("Shape \"trianglemesh\" \"point3 P\" [0 0 0 0 0 0 0 1 0] \"integer indices\" [0 1 2]\n"));
  const Outcome outcome = run({"render", "ok.pbrt", "--quiet"});
  EXPECT_TRUE(outcome.code == 0 || outcome.code == 2) << outcome.err;
}

class Check : public testing::CliTest {};

TEST_F(Check, ListsEveryProblemWithItsKeys) {
  write("bad.pbrt", box_and("Shape \"sphere\" \"float radios\" 1\nMaterial \"difuse\"\n"));
  const Outcome outcome = run({"check", "bad.pbrt", "--json", "--strict"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["format"], "pbrt-v4");
  const auto problems = nlohmann::json::parse(outcome.out)["problems"];
  ASSERT_GE(problems.size(), 2u);
  for (const auto& problem : problems) {
    EXPECT_EQ(problem["file"], "bad.pbrt");
    EXPECT_GE(problem["line"].get<int>(), 12);
    EXPECT_GE(problem["column"].get<int>(), 1);
    EXPECT_EQ(problem["severity"], "error");
    EXPECT_FALSE(problem["message"].get<std::string>().empty());
  }
}

TEST_F(Check, AcceptsAGoodSceneWithoutProblems) {
  write("box.pbrt", kBox);
  const Outcome outcome = run({"check", "box.pbrt", "--json"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_TRUE(nlohmann::json::parse(outcome.out)["problems"].empty());
}

/// A 2 x 2 picture in the test's folder, with one value of its own.
void write_picture(const std::string& name, float usual, float one) {
  Image image(2, 2);
  std::fill(image.data.begin(), image.data.end(), usual);
  image.data[9] = one;  // texel (1, 1)
  write_image(image, name);
}

// What only images show is refused by both verbs, or said in one line by both.
TEST_F(Check, RefusesImagesThatCannotShine) {
  write_picture("sky.exr", 1, NAN);
  write("bad.pbrt", box_and("LightSource \"infinite\" \"string filename\" \"sky.exr\"\n"));
  for (const char* verb : {"check", "render"}) {
    const Outcome outcome = run({verb, "bad.pbrt", "--quiet"});
    EXPECT_EQ(outcome.code, 2) << verb;
    EXPECT_THAT(outcome.out + outcome.err, HasSubstr("bad.pbrt:12:1: ")) << verb;
    EXPECT_THAT(outcome.out + outcome.err,
                HasSubstr("texel (1, 1) of the environment image is not a number"));
  }
  const auto problems = nlohmann::json::parse(run({"check", "bad.pbrt", "--json"}).out)["problems"];
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems[0]["line"], 12);
}

TEST_F(Check, WarnsOfTexturesThatAreClamped) {
  write_picture("paint.exr", 0.5f, 7);
  write("bright.pbrt", box_and("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"paint.exr\"\n"
                               "Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"\n"));
  for (const char* verb : {"check", "render"}) {
    const Outcome outcome = run({verb, "bright.pbrt"});
    EXPECT_EQ(outcome.code, 0) << verb;
    EXPECT_THAT(outcome.out + outcome.err,
                HasSubstr("bright.pbrt:12:1: warning: the texture \"t\" has values from 0 to 7, but the "
                          "reflectance of the material in line 13 is within 0 and 1"))
        << verb;
  }
}

TEST_F(Check, WarnsOfEmittersThatLieOnOthers) {
  const std::string lamp =
      "AreaLightSource \"diffuse\"\nShape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer "
      "indices\" "
      "[0 1 2]\n";
  write("twice.pbrt", box_and(lamp + lamp));
  EXPECT_THAT(run({"check", "twice.pbrt"}).out,
              HasSubstr("twice.pbrt:15:1: warning: an emitter of the shape lies"));
}

TEST_F(Check, NamesTheFolderOfTheScene) {
  std::filesystem::create_directory("deep");
  write("deep/bad.pbrt", "Frob\n");
  EXPECT_THAT(run({"check", "deep/bad.pbrt"}).out, HasSubstr("deep/bad.pbrt:1:1"));
}

}  // namespace
}  // namespace lightmill::client
