#include "client/verbs/diagnose.h"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "common/base/error.h"
#include "common/error/report/report_text.h"
#include "worker/render/diagnose/diagnosis.h"

namespace lightmill::client {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHead = R"(<!doctype html><html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width,initial-scale=1"><title>Diagnosis</title><style>
:root{color-scheme:light dark}body{font:14px/1.5 system-ui,sans-serif;margin:2rem;max-width:80rem}
table{border-collapse:collapse;margin:1rem 0;font-variant-numeric:tabular-nums}
th,td{padding:.15rem .7rem;text-align:right;border-bottom:1px solid #8884}
thead th{position:sticky;top:0;background:Canvas}td:first-child,th:first-child{text-align:left}
figure{display:inline-block;margin:.3rem}figcaption{text-align:center}
img{width:14rem;height:auto;background:#000;image-rendering:pixelated}
.bar{display:inline-block;height:.7em;background:#3b82f6;margin-right:.4em}
</style></head><body><h1>Where the noise comes from</h1>)";

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", x);
  return text;
}

std::string percent(double share) {
  char text[96];
  std::snprintf(text, sizeof text, "<span class=\"bar\" style=\"width:%.1fpx\"></span>%.1f %%", 60 * share,
                100 * share);
  return text;
}

std::string vertices(int n) { return std::to_string(n) + (n == kRecordedVertices ? "+" : ""); }

std::string position(const Vec3d& p) {
  return std::string("(") + number(p.x) + ", " + number(p.y) + ", " + number(p.z) + ")";
}

const char* family(int s, int t) {
  if (s == 0) return "emission hit";
  if (t == 1) return "light tracing";
  return s == 1 ? "next event" : "vertex connection";
}

class Page {
 public:
  Page(fs::path folder, const SceneDescription& scene, const RenderSettings& settings, const Diagnosis& d)
      : folder_(std::move(folder)), scene_(scene), spp_(static_cast<double>(settings.spp)), d_(d) {}

  void write() {
    html_ = kHead;
    write_image(d_.image, (folder_ / "image.exr").string());
    write_image(d_.image, (folder_ / "image.png").string());
    html_ += "<p>" + number(spp_) + " samples per pixel, " + number(d_.cpu_seconds) +
             " CPU s while recording. A strategy (s,t) joins s light and t camera vertices; " +
             std::to_string(kRecordedVertices) + "+ stands for longer ones too.</p>" +
             picture("image", "the image");
    strategies();
    sets();
    discarded();
    brightest();
    html_ += "</body></html>\n";
    const fs::path path = folder_ / "index.html";
    std::ofstream out(path, std::ios::binary);
    out << html_;
    out.close();
    if (!out)
      throw Error(ErrorKind::kFailed, path.string() + ": can't write the diagnosis; choose another folder");
  }

 private:
  static std::string picture(const std::string& name, const std::string& caption) {
    return "<figure><a href=\"" + name + ".exr\"><img alt=\"" + caption + "\" src=\"" + name +
           ".png\"></a><figcaption>" + caption + "</figcaption></figure>";
  }

  void strategies() {
    struct Row {
      int s, t;
      double energy, variance, seconds;
    };
    std::vector<Row> rows;
    double energy = 0, variance = 0, seconds = d_.light_subpath_seconds + d_.camera_subpath_seconds;
    std::string pictures[2];
    for (int length = 1; length <= 2 * kRecordedVertices; ++length) {
      for (int s = 0; s <= std::min(length, kRecordedVertices); ++s) {
        const int t = length - s;
        if (t < 1 || t > kRecordedVertices) continue;
        const auto weighted = d_.film.weighted(s, t, spp_), unweighted = d_.film.unweighted(s, t, spp_);
        const StrategyCounts& c = d_.counts[static_cast<size_t>(s)][static_cast<size_t>(t)];
        if (c.evaluated == 0) continue;
        Row r{s, t, 0, d_.film.relative_variance(s, t, spp_, d_.image), c.cpu_seconds};
        if (weighted) {
          for (const float x : weighted->data) r.energy += static_cast<double>(x);
          const std::string name = std::string("s") + std::to_string(s) + "_t" + std::to_string(t);
          const std::string caption = "s = " + vertices(s) + ", t = " + vertices(t);
          const Image* images[2] = {weighted.get(), unweighted.get()};
          for (size_t k = 0; k < 2; ++k) {
            const std::string file = name + (k == 0 ? "_weighted" : "_unweighted");
            write_image(*images[k], (folder_ / (file + ".exr")).string());
            write_image(*images[k], (folder_ / (file + ".png")).string());
            pictures[k] += picture(file, caption);
          }
        }
        energy += r.energy, variance += r.variance, seconds += r.seconds;
        rows.push_back(r);
      }
      for (std::string& p : pictures) p += "<br>";
    }
    const auto share = [](double part, double whole) { return whole > 0 ? part / whole : 0; };
    html_ +=
        "<h2>Strategies</h2><table><thead><tr><th>strategy</th><th>s</th><th>t</th><th>of the light</th>"
        "<th>of the variance</th><th>of the time</th><th>relMSE at 1 spp</th><th>evaluated</th><th>zero</th>"
        "<th>rouletted</th><th>occluded</th><th>visible</th></tr></thead><tbody>";
    for (const Row& r : rows) {
      const StrategyCounts& c = d_.counts[static_cast<size_t>(r.s)][static_cast<size_t>(r.t)];
      html_ += std::string("<tr><td>") + family(r.s, r.t) + "</td><td>" + vertices(r.s) + "</td><td>" +
               vertices(r.t) + "</td><td>" + percent(share(r.energy, energy)) + "</td><td>" +
               percent(share(r.variance, variance)) + "</td><td>" + percent(share(r.seconds, seconds)) +
               "</td><td>" + number(r.variance) + "</td>";
      for (const uint64_t n : {c.evaluated, c.zero, c.rouletted, c.occluded, c.visible}) {
        html_ += "<td>" + std::to_string(n) + "</td>";
      }
      html_ += "</tr>";
    }
    html_ += "<tr><td>camera subpaths</td><td></td><td></td><td></td><td></td><td>" +
             percent(share(d_.camera_subpath_seconds, seconds)) +
             "</td></tr><tr><td>light subpaths</td><td></td><td></td><td></td><td></td><td>" +
             percent(share(d_.light_subpath_seconds, seconds)) + "</td></tr></tbody></table>";
    html_ += "<h2>With their MIS weights: they add up to the image</h2>" + pictures[0];
    html_ += "<h2>Unweighted: each alone estimates the paths that it can make</h2>" + pictures[1];
  }

  /// What leaving families out would do: noise from these very samples, cost from the times of their parts.
  void sets() {
    double family[4] = {};
    for (int s = 0; s <= kRecordedVertices; ++s) {
      for (int t = 0; t <= kRecordedVertices; ++t) {
        const size_t f = s == 0 ? 0 : t == 1 ? 2 : s == 1 ? 1 : 3;
        family[f] += d_.counts[static_cast<size_t>(s)][static_cast<size_t>(t)].cpu_seconds;
      }
    }
    const double samples = spp_ * static_cast<double>(d_.pixels);
    html_ +=
        "<h2>Other sets of strategies, predicted</h2><table><thead><tr><th>--strategies</th>"
        "<th>relMSE at 1 spp</th><th>µs a sample</th><th>relMSE × µs</th></tr></thead><tbody>";
    for (size_t i = 0; i < StrategyFilm::kSets; ++i) {
      const Strategies set = StrategyFilm::set(i);
      double seconds = d_.camera_subpath_seconds + (set & kLightPaths ? d_.light_subpath_seconds : 0);
      for (unsigned f = 0; f < 4; ++f) seconds += set >> f & 1 ? family[f] : 0;
      const double variance = d_.film.predicted_variance(i, spp_, d_.image), cost = 1e6 * seconds / samples;
      html_ += "<tr><td>" + strategy_names(set) + "</td><td>" + number(variance) + "</td><td>" +
               number(cost) + "</td><td>" + number(variance * cost) + "</td></tr>";
    }
    html_ += "</tbody></table>";
  }

  void discarded() {
    const auto row = [&](const char* what, uint64_t n) {
      html_ += std::string("<tr><td>") + what + "</td><td>" + std::to_string(n) + "</td></tr>";
    };
    html_ += "<h2>Discarded</h2><table><tbody>";
    row("contributions that were not finite", d_.dropped.of(DropKind::kNotFinite).count);
    row("samples that were negative", d_.dropped.of(DropKind::kNegative).count);
    row("contributions too bright for the image's sums", d_.dropped.of(DropKind::kOutOfRange).count);
    row("samples scaled down to the film's limit", d_.dropped.of(DropKind::kCapped).count);
    row("contributions too dark for the image's sums", d_.dropped.of(DropKind::kBelowRange).count);
    row("hits whose shading and geometric normals disagree on the side", d_.inconsistent_hits);
    row("connections of zero contribution (no shadow ray)", d_.counters.zero_connections_skipped);
    row("connections lost at Russian roulette", d_.counters.rouletted_connections);
    html_ += "</tbody></table>";
  }

  std::string subpath(const std::vector<BrightPath::Vertex>& list) const {
    std::string text;
    for (const BrightPath::Vertex& v : list) {
      const std::string& name = scene_.materials[static_cast<size_t>(v.material)].name;
      if (!text.empty()) text += " → ";
      text += position(v.position) + " on " +
              escape_markup(name.empty() ? "material " + std::to_string(v.material) : "\"" + name + "\"");
    }
    return text.empty() ? "–" : text;
  }

  void brightest() {
    html_ +=
        "<h2>Brightest contributions</h2><table><thead><tr><th>pixel</th><th>sample</th><th>s</th><th>t</th>"
        "<th>value</th><th>MIS weight</th><th>pixel's mean</th><th>surface vertices from the camera</th>"
        "<th>from the light</th></tr></thead><tbody>";
    for (const BrightPath& p : d_.brightest) {
      const StrategyContribution& c = p.contribution;
      const int x = static_cast<int>(c.pixel) % d_.image.width,
                y = static_cast<int>(c.pixel) / d_.image.width;
      const float* mean = d_.image.pixel(x, y);
      const auto rgb = [](const float* v) { return number(v[0]) + " " + number(v[1]) + " " + number(v[2]); };
      html_ += "<tr><td>" + std::to_string(x) + ", " + std::to_string(y) + "</td><td>" +
               std::to_string(p.sample) + "</td><td>" + std::to_string(c.s) + "</td><td>" +
               std::to_string(c.t) + "</td><td>" + rgb(c.rgb) + "</td><td>" + number(c.weight) + "</td><td>" +
               rgb(mean) + "</td><td>" + subpath(p.camera) + "</td><td>" + subpath(p.light) + "</td></tr>";
    }
    html_ += "</tbody></table>";
  }

  const fs::path folder_;
  const SceneDescription& scene_;
  const double spp_;
  const Diagnosis& d_;
  std::string html_;
};

}  // namespace

void write_diagnosis(const std::string& folder, const SceneDescription& scene, const RenderSettings& settings,
                     int threads, const std::function<bool()>& go_on) {
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec) {
    throw Error(ErrorKind::kFailed,
                folder + ": can't make the folder (" + ec.message() + "); choose another with --diagnose");
  }
  const Diagnosis d = diagnose(scene, settings, threads, go_on);
  Page(folder, scene, settings, d).write();
}

}  // namespace lightmill::client
