#pragma once
// Text of the report's files: numbers and markup.
#include <optional>
#include <string>
#include <string_view>

namespace lightmill {

/// The shortest decimal that reads back as the same double, in any locale.
std::string exact_number(double value);
/// `digits` significant digits, for people: "0.00123", "1.5e-07", "12.3".
std::string short_number(double value, int digits = 3);
/// "0.0123 (95 %: 0.0101 to 0.015)", or the value alone, or nothing, as far as they are known.
std::string interval_text(const std::optional<double>& value, const std::optional<double>& low,
                          const std::optional<double>& high);
/// Seconds for people: "0.42 s", "12.3 s", "4 min 05 s", "2 h 10 min".
std::string short_duration(double seconds);
/// Escapes & < > " ' for XML and HTML and drops control characters.
std::string escape_markup(std::string_view text);
/// At most `bytes` bytes of UTF-8 text and "…" if it was longer; never half a character.
std::string utf8_prefix(std::string_view text, size_t bytes);
std::string base64(std::string_view bytes);

}  // namespace lightmill
