#pragma once
// What a terminal can do, and pictures on it.
#include <cstdio>
#include <string>

#include "common/image/image.h"

namespace lightmill::client {

bool is_terminal(std::FILE* stream);
/// Colours: on a terminal, unless NO_COLOR is set (no-color.org) or TERM is "dumb".
bool has_colour(std::FILE* stream);
/// Width and height in characters; 80 x 24 if it is not known.
int terminal_columns(std::FILE* stream);
int terminal_rows(std::FILE* stream);
/// `text` in a colour (an SGR code such as "1;32") where `colour` says so.
std::string coloured(const std::string& text, const char* sgr, bool colour);

/// A number by printf's `pattern`, which makes at most 63 characters of it.
std::string format(const char* pattern, double value);

/// The image in 24-bit colours, two pixels a character (upper half blocks), a line of them ending in '\n'.
std::string terminal_picture(const Image& image, const ViewTransform& view);

}  // namespace lightmill::client
