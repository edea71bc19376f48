#include "common/image/denoise/planes.h"

#include <algorithm>

namespace lightmill::denoise {

namespace {

constexpr int kColumnsTogether = 64;

/// Along a row: prefix sums in double, which lose nothing that matters.
void mean_of_row(int width, int radius, float* row, std::vector<double>* prefix) {
  prefix->resize(static_cast<size_t>(width) + 1);
  double* sum = prefix->data();
  sum[0] = 0;
  for (int x = 0; x < width; ++x) sum[x + 1] = sum[x] + double{row[x]};
  for (int x = 0; x < width; ++x) {
    const int begin = std::max(0, x - radius), end = std::min(width, x + radius + 1);
    row[x] = static_cast<float>((sum[end] - sum[begin]) / (end - begin));
  }
}

}  // namespace

void box_mean(const Extent& extent, int radius, int threads, Plane* plane) {
  const auto bands = static_cast<size_t>((extent.height + kRowsTogether - 1) / kRowsTogether);
  parallel_for(bands, threads, [&](size_t band) {
    std::vector<double> prefix;
    const int begin = static_cast<int>(band) * kRowsTogether;
    for (int y = begin; y < std::min(begin + kRowsTogether, extent.height); ++y) {
      mean_of_row(extent.width, radius, &(*plane)[extent.at(0, y)], &prefix);
    }
  });
  // Columns beside each other together, a running sum each.
  const auto groups = static_cast<size_t>((extent.width + kColumnsTogether - 1) / kColumnsTogether);
  parallel_for(groups, threads, [&](size_t group) {
    const int x0 = static_cast<int>(group) * kColumnsTogether;
    const int columns = std::min(kColumnsTogether, extent.width - x0), height = extent.height;
    std::vector<float> copy(static_cast<size_t>(columns) * static_cast<size_t>(height));
    const auto row = [&](int y) { return &copy[static_cast<size_t>(y) * static_cast<size_t>(columns)]; };
    for (int y = 0; y < height; ++y) std::copy_n(&(*plane)[extent.at(x0, y)], columns, row(y));
    double sum[kColumnsTogether] = {};
    for (int y = 0; y < std::min(radius, height); ++y) {
      for (int x = 0; x < columns; ++x) sum[x] += double{row(y)[x]};
    }
    for (int y = 0; y < height; ++y) {
      const int in = y + radius, out = y - radius - 1;
      for (int x = 0; in < height && x < columns; ++x) sum[x] += double{row(in)[x]};
      for (int x = 0; out >= 0 && x < columns; ++x) sum[x] -= double{row(out)[x]};
      const double rows = std::min(height, in + 1) - std::max(0, y - radius);
      float* to = &(*plane)[extent.at(x0, y)];
      for (int x = 0; x < columns; ++x) to[x] = static_cast<float>(sum[x] / rows);
    }
  });
}

Plane box_max(const Extent& extent, int radius, int threads, const Plane& plane) {
  Plane along_rows(plane.size()), result(plane.size());
  for_rows(extent, threads, [&](int y) {
    const float* from = &plane[extent.at(0, y)];
    float* to = &along_rows[extent.at(0, y)];
    for (int x = 0; x < extent.width; ++x) {
      const int begin = std::max(0, x - radius), end = std::min(extent.width, x + radius + 1);
      to[x] = *std::max_element(from + begin, from + end);
    }
  });
  for_rows(extent, threads, [&](int y) {
    float* to = &result[extent.at(0, y)];
    std::copy_n(&along_rows[extent.at(0, y)], extent.width, to);
    for (int v = std::max(0, y - radius); v < std::min(extent.height, y + radius + 1); ++v) {
      const float* from = &along_rows[extent.at(0, v)];
      for (int x = 0; x < extent.width; ++x) to[x] = std::max(to[x], from[x]);
    }
  });
  return result;
}

}  // namespace lightmill::denoise
