#include "common/film/dropped_text.h"

#include <algorithm>
#include <cstdio>

namespace lightmill {

namespace {

/// Light below the sums' range is no news if it has less of the image than this.
constexpr double kUnseen = 1e-6;

struct Words {
  const char* one;     // after "1"
  const char* many;    // after a larger number
  const char* share;   // "%s" is the percentage
  const char* advice;  // of a warning
};
constexpr std::array<Words, kDropKinds> kWords = {{
    {"contribution was not finite and was dropped", "contributions were not finite and were dropped",
     "in at most %s of the samples",
     "a number in the scene is out of the range of floats, or Lightmill is wrong: please report it"},
    {"sample was negative and was dropped", "samples were negative and were dropped", "about %s of the image",
     "look for negative colours in the scene's lights and textures"},
    {"contribution was too bright for the image's sums and was dropped",
     "contributions were too bright for the image's sums and were dropped", "about %s of the image",
     "make the scene's brightest lamps larger and dimmer"},
    {"sample was brighter than the film's \"maxcomponentvalue\" and was scaled down to it",
     "samples were brighter than the film's \"maxcomponentvalue\" and were scaled down to it",
     "about %s of the image", "a higher limit, or none, keeps this light"},
    {"contribution was too dark for the image's sums and counts as black",
     "contributions were too dark for the image's sums and count as black", "about %s of the image",
     "the scene's brightest lamp is too bright beside this light"},
}};

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g %%", 100 * share);
  return share > 0.995 ? "100 %" : text;
}

DroppedLine line_of(const Words& words, const DroppedShare& dropped) {
  DroppedLine line{std::to_string(dropped.count) + " " + (dropped.count == 1 ? words.one : words.many)};
  if (!dropped.share) return line;
  std::string share = words.share;
  share.replace(share.find("%s"), 2, percent(*dropped.share));
  line.text += ", " + share;
  line.warning = *dropped.share > kDroppedWarning;
  if (line.warning) line.text += std::string("; ") + words.advice;
  return line;
}

}  // namespace

std::vector<DroppedLine> dropped_lines(const DroppedShares& dropped, uint64_t refused) {
  std::vector<DroppedLine> lines;
  uint64_t known = 0;
  for (size_t i = 0; i < kDropKinds; ++i) {
    const DropKind kind = static_cast<DropKind>(i);
    if (kind < DropKind::kCapped) known += dropped[i].count;
    if (dropped[i].count == 0) continue;
    if (kind == DropKind::kBelowRange && dropped[i].share.value_or(0) < kUnseen) continue;
    lines.push_back(line_of(kWords[i], dropped[i]));
  }
  if (refused > known) {
    lines.push_back({std::to_string(refused - known) +
                         " contributions were not finite, negative or too bright and were dropped",
                     true});
  }
  return lines;
}

}  // namespace lightmill
