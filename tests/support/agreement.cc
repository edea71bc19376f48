#include "tests/support/agreement.h"

#include <algorithm>
#include <cmath>

namespace lightmill::test {
namespace {

constexpr int kBlock = 8;

struct Cell {
  PixelRect rect;
  int channel;
  Estimate a, b;
};

}  // namespace

Agreement compare_blocks(const Batches& a, const Batches& b, const AgreementTest& test) {
  Agreement result;
  std::vector<Cell> judged;
  const int width = a.images[0].width, height = a.images[0].height;
  for (int y = 0; y < height; y += kBlock) {
    for (int x = 0; x < width; x += kBlock) {
      const PixelRect rect{x, y, std::min(x + kBlock, width), std::min(y + kBlock, height)};
      if (test.include && !test.include(rect)) continue;
      for (int c = 0; c < 3; ++c) {
        const Estimate ea = a.mean(rect, c), eb = b.mean(rect, c);
        const double larger = std::max(std::fabs(ea.mean), std::fabs(eb.mean));
        if (larger == 0) {
          ++result.judged;  // both are black
        } else if (std::max(ea.standard_error, eb.standard_error) > test.max_relative_error * larger) {
          ++result.excluded;
        } else {
          ++result.judged;
          judged.push_back({rect, c, ea, eb});
        }
      }
    }
  }
  const double level = sidak(test.alpha, std::max<int64_t>(1, result.judged));
  std::vector<double> widths;
  for (const Cell& cell : judged) {
    const double larger = std::max(std::fabs(cell.a.mean), std::fabs(cell.b.mean));
    const double se = std::hypot(cell.a.standard_error, cell.b.standard_error);
    widths.push_back(student_quantile(level, cell.a.n + cell.b.n - 2) * se / larger);
    if (std::fabs(cell.a.mean - cell.b.mean) <= test.rounding * larger) continue;
    if (test.one_sided && cell.a.mean < cell.b.mean) continue;
    const double p = welch_p(cell.a, cell.b);
    if (p < level) ++result.failed;
    if (p < result.worst_p) {
      result.worst_p = p;
      result.worst = cell.rect;
      result.worst_channel = cell.channel;
      result.worst_a = cell.a;
      result.worst_b = cell.b;
    }
  }
  if (!widths.empty()) {
    const auto middle = widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2);
    std::nth_element(widths.begin(), middle, widths.end());
    result.median_resolution = *middle;
  }
  return result;
}

::testing::AssertionResult images_agree(const Batches& a, const Batches& b, const AgreementTest& test) {
  const Agreement r = compare_blocks(a, b, test);
  const auto text = [&](const char* what) {
    return ::testing::AssertionFailure()
           << what << ": " << r.failed << " of " << r.judged << " blocks fail, " << r.excluded
           << " are too noisy; worst at (" << r.worst.x0 << ", " << r.worst.y0 << ") channel "
           << r.worst_channel << ": " << r.worst_a.mean << " (" << r.worst_a.standard_error << ") against "
           << r.worst_b.mean << " (" << r.worst_b.standard_error << "), p = " << r.worst_p
           << "; a block resolves " << r.median_resolution;
  };
  if (r.judged == 0) return text("nothing to judge");
  if (r.excluded > test.max_excluded * (r.judged + r.excluded)) return text("too many blocks are too noisy");
  if (r.failed > 0) return text("the images differ");
  return ::testing::AssertionSuccess() << "a block resolves " << r.median_resolution;
}

Batches scaled(const Batches& batches, float factor) {
  Batches result = batches;
  for (Image& image : result.images) {
    for (float& x : image.data) x *= factor;
  }
  return result;
}

}  // namespace lightmill::test
