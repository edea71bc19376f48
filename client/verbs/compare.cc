// lightmill compare: image metrics against a reference.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli.h"
#include "client/options.h"
#include "common/error/metrics.h"
#include "common/image/image.h"

namespace lightmill::client {
namespace {

struct CompareOptions {
  CommonOptions common;
  std::string image, reference;
};

int compare(const CompareOptions& options) {
  const Metrics m = compare_images(read_image(options.image), read_image(options.reference));
  if (options.common.json) {
    nlohmann::json document = {{"mse", m.mse}, {"relmse", m.relmse}, {"relmse_trimmed", m.relmse_trimmed},
                               {"mae", m.mae}, {"flip", m.flip},     {"mean_ratio", m.mean_ratio}};
    for (size_t i = 0; i < kBoxSides.size(); ++i) {
      const std::optional<double>& boxes = m.relmse_of_boxes[i];
      document["relmse_" + std::to_string(kBoxSides[i])] =
          boxes ? nlohmann::json(*boxes) : nlohmann::json(nullptr);
    }
    std::printf("%s\n", document.dump(2).c_str());
    return 0;
  }
  std::printf("MSE             %.6g\n", m.mse);
  std::printf("relMSE          %.6g\n", m.relmse);
  for (size_t i = 0; i < kBoxSides.size(); ++i) {
    if (m.relmse_of_boxes[i]) std::printf("relMSE of %2d px %.6g\n", kBoxSides[i], *m.relmse_of_boxes[i]);
  }
  std::printf("relMSE trimmed  %.6g\n", m.relmse_trimmed);
  std::printf("MAE             %.6g\n", m.mae);
  std::printf("FLIP            %.6g\n", m.flip);
  std::printf("mean ratio      %.6g\n", m.mean_ratio);
  return 0;
}

}  // namespace

void add_compare(CLI::App& app, Action& action) {
  auto options = std::make_shared<CompareOptions>();
  CLI::App* verb = add_verb(app, "compare", "Measure an image against a reference", &options->common);
  add_json(verb, &options->common);
  verb->add_option("IMAGE", options->image, "The image to judge")->required();
  verb->add_option("REFERENCE", options->reference, "What it should look like")->required();
  verb->callback([&action, options] { action = [options] { return compare(*options); }; });
}

}  // namespace lightmill::client
