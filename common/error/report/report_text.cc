#include "common/error/report/report_text.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace lightmill {

std::string exact_number(double value) {
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, end.ptr};
}

std::string short_number(double value, int digits) {
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, digits);
  return {buffer, end.ptr};
}

std::string interval_text(const std::optional<double>& value, const std::optional<double>& low,
                          const std::optional<double>& high) {
  if (!value) return "";
  std::string text = short_number(*value);
  if (low && high) text += " (95 %: " + short_number(*low) + " to " + short_number(*high) + ")";
  return text;
}

std::string short_duration(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0) return "unknown";
  char buffer[48];
  if (seconds < 100) return short_number(seconds) + " s";
  if (seconds < 6000) {
    const auto whole = static_cast<long long>(std::llround(seconds));
    std::snprintf(buffer, sizeof buffer, "%lld min %02lld s", whole / 60, whole % 60);
    return buffer;
  }
  const double minutes = seconds / 60;
  if (minutes > 1e9) return short_number(minutes / 60) + " h";
  const auto whole = static_cast<long long>(std::llround(minutes));
  std::snprintf(buffer, sizeof buffer, "%lld h %02lld min", whole / 60, whole % 60);
  return buffer;
}

std::string escape_markup(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20) out += c;
    }
  }
  return out;
}

std::string utf8_prefix(std::string_view text, size_t bytes) {
  if (text.size() <= bytes) return std::string(text);
  while (bytes > 0 && (static_cast<unsigned char>(text[bytes]) & 0xc0) == 0x80) --bytes;
  return std::string(text.substr(0, bytes)) + "…";
}

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k) {
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (size_t k = 0; k < 4; ++k) {
      out += i + k <= bytes.size() ? kDigits[(word >> (18 - 6 * k)) & 63] : '=';
    }
  }
  return out;
}

}  // namespace lightmill
