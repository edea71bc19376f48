#include "client/terminal/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>

namespace lightmill::client {
namespace {

winsize size_of(std::FILE* stream) {
  winsize size{};
  if (ioctl(fileno(stream), TIOCGWINSZ, &size) != 0) size = {};
  return size;
}

std::string colour_code(const char* layer, const float* rgb) {
  std::string code = "\033[";
  code.append(layer).append(";2");
  for (int c = 0; c < 3; ++c) {
    code += ';';
    code += std::to_string(std::lround(255 * rgb[c]));
  }
  code += 'm';
  return code;
}

}  // namespace

bool is_terminal(std::FILE* stream) { return isatty(fileno(stream)) == 1; }

bool has_colour(std::FILE* stream) {
  const char* off = std::getenv("NO_COLOR");
  const char* term = std::getenv("TERM");
  return is_terminal(stream) && !(off && *off) && !(term && std::strcmp(term, "dumb") == 0);
}

int terminal_columns(std::FILE* stream) {
  const int columns = size_of(stream).ws_col;
  return columns > 0 ? columns : 80;
}

int terminal_rows(std::FILE* stream) {
  const int rows = size_of(stream).ws_row;
  return rows > 0 ? rows : 24;
}

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

std::string coloured(const std::string& text, const char* sgr, bool colour) {
  if (!colour) return text;
  std::string code = "\033[";
  return code.append(sgr).append(1, 'm').append(text).append("\033[0m");
}

std::string terminal_picture(const Image& image, const ViewTransform& view) {
  Image shown(image.width, image.height);
  view_pixels(image.data.data(), image.data.size() / 3, 3, view, shown.data.data());
  std::string picture;
  for (int y = 0; y < image.height; y += 2) {
    for (int x = 0; x < image.width; ++x) {
      picture += colour_code("38", shown.pixel(x, y));
      if (y + 1 < image.height) picture += colour_code("48", shown.pixel(x, y + 1));
      picture += "\u2580";
    }
    picture += "\033[0m\n";
  }
  return picture;
}

}  // namespace lightmill::client
