#include "client/frames.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <istream>
#include <set>
#include <string_view>

#include "common/base/error.h"
#include "common/base/lower_case.h"

namespace lightmill::client {
namespace {

constexpr size_t kMaxLineBytes = 4096;

Error bad_frames(const std::string& text) {
  return {ErrorKind::kUsage, "--frames " + text +
                                 ": expected numbers and ranges such as 1-100, 1-100x2 or 1-10,20, at most " +
                                 std::to_string(kMaxFrames) + " frames"};
}

/// Takes a whole number from the front; a "-" before it only where one may stand.
bool take_number(std::string_view* text, int* number) {
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), *number);
  if (error != std::errc()) return false;
  text->remove_prefix(static_cast<size_t>(end - text->data()));
  return true;
}

bool take(std::string_view* text, char c) {
  if (text->empty() || text->front() != c) return false;
  text->remove_prefix(1);
  return true;
}

std::string extension_of_scene(const std::string& name) {
  return lower_case(std::filesystem::path(name).extension().string());
}

std::vector<std::string> lines_of(std::istream& list) {
  std::vector<std::string> lines;
  std::string line;
  while (std::getline(list, line)) {
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    if (line.empty()) continue;
    if (line.size() > kMaxLineBytes)
      throw Error(ErrorKind::kUsage, "-: a line of the list of files is longer than 4096 bytes");
    lines.push_back(line);
    if (lines.size() > kMaxFrames) {
      throw Error(ErrorKind::kUsage,
                  "-: the list has more than " + std::to_string(kMaxFrames) + " files; submit it in parts");
    }
  }
  if (lines.empty()) throw Error(ErrorKind::kUsage, "-: no file is named on standard input");
  return lines;
}

}  // namespace

void add_frames(CLI::App* verb, FrameOptions* options) {
  verb->add_option("--frames", options->frames,
                   "Frames A-B[xSTEP][,...]: of a glTF animation at --fps, or of scene files named by a "
                   "pattern such as scene.%04d.pbrt");
  verb->add_option("--order", options->order,
                   "Which frames come first: sequential, or coarse-first (every tenth, then the others)")
      ->check(CLI::IsMember({"sequential", "coarse-first"}))
      ->capture_default_str();
  verb->add_option("--quality", options->quality, "equal: every frame to the same --target-error")
      ->check(CLI::IsMember({"equal"}));
  verb->add_option_function<std::string>(
      "--budget",
      [options](const std::string& text) { options->budget_seconds = parse_duration(text, "--budget"); },
      "Processor time for all frames together, spent where the error falls most: 90 (seconds), 30m, 12h, 2d");
}

double parse_duration(const std::string& text, const std::string& option) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  const std::string_view unit(stop, static_cast<size_t>(end - stop));
  for (const auto& [name, seconds] :
       {std::pair{"", 1.0}, {"s", 1.0}, {"m", 60.0}, {"min", 60.0}, {"h", 3600.0}, {"d", 86400.0}}) {
    if (error == std::errc() && unit == name && value > 0 && value * seconds <= 1e12) return value * seconds;
  }
  throw Error(ErrorKind::kUsage, option + " " + text + ": expected a time such as 90, 30m, 12h or 2d");
}

std::vector<int> parse_frames(const std::string& text) {
  std::vector<int> frames;
  std::set<int> known;
  std::string_view rest = text;
  do {
    int first = 0, last = 0, step = 1;
    if (!take_number(&rest, &first)) throw bad_frames(text);
    last = first;
    if (take(&rest, '-') && !take_number(&rest, &last)) throw bad_frames(text);
    if (take(&rest, 'x') && (!take_number(&rest, &step) || step < 1)) throw bad_frames(text);
    if (last < first) throw bad_frames(text);
    const int64_t count = (int64_t{last} - first) / step + 1;
    if (count > static_cast<int64_t>(kMaxFrames)) throw bad_frames(text);
    for (int64_t i = 0; i < count; ++i) {
      const int frame = static_cast<int>(first + i * step);
      if (known.insert(frame).second) frames.push_back(frame);
    }
    if (frames.size() > kMaxFrames) throw bad_frames(text);
  } while (take(&rest, ','));
  if (!rest.empty()) throw bad_frames(text);
  return frames;
}

std::optional<FramePattern> FramePattern::find(const std::string& name) {
  std::optional<FramePattern> found;
  std::string plain;
  const auto place = [&](size_t digits) {
    if (found) throw Error(ErrorKind::kUsage, name + ": it has two places for the frame's number; give one");
    found.emplace();
    found->before_ = std::move(plain);
    found->digits_ = digits;
    plain.clear();
  };
  for (size_t at = 0; at < name.size();) {
    if (name[at] == '#') {
      const size_t end = std::min(name.find_first_not_of('#', at), name.size());
      place(end - at);
      at = end;
    } else if (name[at] == '%' && at + 1 < name.size() && name[at + 1] == '%') {
      plain += '%';
      at += 2;
    } else if (name[at] == '%') {
      size_t end = at + 1;
      while (end < name.size() && name[end] >= '0' && name[end] <= '9') ++end;
      const std::string digits = name.substr(at + 1, end - at - 1);
      const bool padded = digits.size() == 2 && digits[0] == '0';
      if (end == name.size() || name[end] != 'd' || !(digits.empty() || padded)) {
        throw Error(ErrorKind::kUsage, name + ": of printf's forms only %d and %0Nd with one digit N may " +
                                           "stand in it, and %% for a percent sign");
      }
      place(padded ? static_cast<size_t>(digits[1] - '0') : 0);
      at = end + 1;
    } else {
      plain += name[at++];
    }
  }
  if (found) found->after_ = std::move(plain);
  return found;
}

FramePattern FramePattern::require(const std::string& name, const std::string& option) {
  if (std::optional<FramePattern> found = find(name)) return *found;
  throw Error(ErrorKind::kUsage, option + " " + name +
                                     ": many frames go into many files; name them as shot.%04d.exr or "
                                     "shot.####.exr");
}

std::string FramePattern::name_of(int frame) const {
  std::string number = std::to_string(std::abs(int64_t{frame}));
  const size_t sign = frame < 0 ? 1 : 0;
  if (number.size() + sign < digits_) number.insert(0, digits_ - sign - number.size(), '0');
  return before_ + (frame < 0 ? "-" : "") + number + after_;
}

bool wants_frames(const SceneOptions& scene, const FrameOptions& options) {
  if (options.given() || scene.scene == "-") return true;
  if (options.order != "sequential" || !options.quality.empty() || options.budget_seconds > 0)
    throw Error(ErrorKind::kUsage, "--order, --quality and --budget are for sequences; give --frames too");
  return false;
}

std::vector<SceneFrame> scene_frames(const SceneOptions& scene, const FrameOptions& options,
                                     std::istream& list) {
  std::vector<SceneFrame> frames;
  if (scene.scene == "-") {
    const std::vector<std::string> files = lines_of(list);
    const std::vector<int> numbers = options.given() ? parse_frames(options.frames) : std::vector<int>();
    if (options.given() && numbers.size() != files.size()) {
      throw Error(ErrorKind::kUsage, "--frames " + options.frames + " has " + std::to_string(numbers.size()) +
                                         " frames, and standard input names " + std::to_string(files.size()) +
                                         " files");
    }
    for (size_t i = 0; i < files.size(); ++i)
      frames.push_back({numbers.empty() ? static_cast<int>(i) + 1 : numbers[i], files[i], {}});
    return frames;
  }
  const bool is_file = std::filesystem::exists(scene.scene);  // whatever signs its name has
  if (const auto pattern = is_file ? std::nullopt : FramePattern::find(scene.scene)) {
    for (const int number : parse_frames(options.frames))
      frames.push_back({number, pattern->name_of(number), {}});
    return frames;
  }
  const std::string extension = extension_of_scene(scene.scene);
  if (extension != ".gltf" && extension != ".glb") {
    throw Error(ErrorKind::kUsage,
                "--frames: " + scene.scene +
                    " is one picture; only glTF files have animations. Name a file for each "
                    "frame, as scene.%04d.pbrt");
  }
  if (scene.pose.time)
    throw Error(ErrorKind::kUsage, "--time-of and --frames: the frames say the times; leave --time-of out");
  for (const int number : parse_frames(options.frames))
    frames.push_back({number, scene.scene, number / scene.fps});
  return frames;
}

}  // namespace lightmill::client
