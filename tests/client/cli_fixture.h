#pragma once
// Runs command lines in this process, in a folder of their own, and captures what they print.
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "client/cli.h"

namespace lightmill::client::testing {

struct Outcome {
  int code;
  std::string out, err;
};

inline constexpr char kBox[] = R"(LookAt 0 1 6.8  0 1 0  0 1 0
Camera "perspective" "float fov" 19.5
Sampler "sobol" "integer pixelsamples" 2
Film "rgb" "integer xresolution" 40 "integer yresolution" 24 "string filename" "sub/box.exr"
WorldBegin
AttributeBegin
AreaLightSource "diffuse" "rgb L" [17 12 4]
Shape "trianglemesh" "point3 P" [-0.24 1.98 -0.22 0.23 1.98 -0.22 0.23 1.98 0.16] "integer indices" [0 1 2]
AttributeEnd
Material "diffuse" "rgb reflectance" [0.7 0.7 0.7]
Shape "trianglemesh" "point3 P" [-1 0 -1 -1 0 1 1 0 1 1 0 -1] "integer indices" [0 1 2 0 2 3]
)";

class CliTest : public ::testing::Test {
 protected:
  void SetUp() override {
    home_ = std::filesystem::current_path();
    std::string name = (std::filesystem::temp_directory_path() / "lightmill-cli-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    std::filesystem::current_path(folder_);
    unsetenv("LIGHTMILL_COORDINATOR");
    unsetenv("OCIO");
  }
  void TearDown() override {
    std::filesystem::current_path(home_);
    std::filesystem::remove_all(folder_);
  }
  Outcome run(std::vector<std::string> arguments) {
    std::vector<const char*> argv = {"lightmill"};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    const int code = run_cli(static_cast<int>(argv.size()), argv.data());
    return {code, ::testing::internal::GetCapturedStdout(), ::testing::internal::GetCapturedStderr()};
  }
  /// A file in the test's folder; returns its name.
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return name;
  }
  static int lines(const std::string& text) {
    return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
  }
  std::filesystem::path folder_, home_;
};

}  // namespace lightmill::client::testing
