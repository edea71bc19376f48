#include "common/farm/sequence_types.h"

#include <charconv>
#include <stdexcept>

namespace lightmill {
namespace {

/// A whole number that fills the text, written as this program writes it.
template <class T>
std::optional<T> whole_number(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || std::to_string(value) != text) return {};
  return value;
}

}  // namespace

const char* frame_order_name(FrameOrder order) {
  switch (order) {
    case FrameOrder::kSequential:
      return "sequential";
    case FrameOrder::kCoarseFirst:
      return "coarse-first";
  }
  throw std::logic_error("unknown order of frames");
}

std::optional<FrameOrder> frame_order_from_name(const std::string& name) {
  for (const FrameOrder order : {FrameOrder::kSequential, FrameOrder::kCoarseFirst}) {
    if (name == frame_order_name(order)) return order;
  }
  return std::nullopt;
}

int frame_pass(FrameOrder order, size_t index) {
  constexpr size_t kCoarseStep = 10;
  return order == FrameOrder::kCoarseFirst && index % kCoarseStep != 0 ? 1 : 0;
}

JobId frame_job(const FrameOf& frame) {
  return JobId{frame.sequence.value + "." + std::to_string(frame.number)};
}

std::optional<FrameOf> frame_of(const JobId& job) {
  const size_t dot = job.value.find('.');
  if (dot == std::string::npos || !is_sequence_id(job.value.substr(0, dot))) return std::nullopt;
  const std::optional<int> number = whole_number<int>(std::string_view(job.value).substr(dot + 1));
  if (!number) return std::nullopt;
  return FrameOf{SequenceId{job.value.substr(0, dot)}, *number};
}

bool is_sequence_id(const std::string& text) {
  return text.size() > 1 && text[0] == 's' && whole_number<int64_t>(std::string_view(text).substr(1)) >= 1;
}

}  // namespace lightmill
