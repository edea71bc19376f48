#include "worker/agent/packet_renderer.h"

#include "worker/render/plan/first_look.h"
#include "worker/render/plan/pilot.h"

namespace lightmill::agent {
namespace {

class SceneRenderer : public PacketRenderer {
 public:
  SceneRenderer(SceneDescription scene, const RenderSettings& settings, const BuildOptions& options)
      : renderer_(std::move(scene), settings, options) {}
  SceneRenderer(const Renderer& other, const RenderSettings& settings) : renderer_(other, settings) {}
  std::vector<std::string> warnings() const { return renderer_.warnings(); }
  const FilmGrid& grid() const override { return renderer_.settings().grid; }
  int quantum_exponent() const override { return renderer_.quantum_exponent(); }
  bool has_camera_layer() const override { return renderer_.has_camera_layer(); }
  bool has_splat_layer() const override { return renderer_.has_splat_layer(); }
  AovSpec aovs() const override { return renderer_.aovs(); }
  std::vector<std::string> missing_light() const override { return renderer_.missing_light(); }
  std::unique_ptr<Workspace> make_workspace() const override { return renderer_.make_workspace(); }
  void render_packet(const Packet& packet, Workspace& workspace, PartialBuilder& builder) const override {
    renderer_.render_packet(packet, workspace, builder);
  }
  uint64_t memory_bytes() const override { return renderer_.memory_bytes(); }
  Image first_look(int threads, const std::function<bool()>& go_on) const override {
    return lightmill::first_look(renderer_, threads, go_on);
  }
  PilotReport run_pilot(int threads, const std::function<bool()>& go_on) const override {
    PilotReport report = lightmill::run_pilot(renderer_, threads, go_on);
    RenderSettings chosen = renderer_.settings();
    chosen.plan = report.chosen;
    const Renderer under_plan(renderer_, chosen);
    for (const PlanItem& item : under_plan.plan().items)
      report.features.push_back({item.feature, item.needed, item.reason, item.saving});
    report.missing_light = under_plan.missing_light();
    return report;
  }
  std::shared_ptr<const PacketRenderer> with_settings(const RenderSettings& settings) const override {
    return std::make_shared<SceneRenderer>(renderer_, settings);
  }

 private:
  Renderer renderer_;
};

}  // namespace

std::shared_ptr<const PacketRenderer> make_packet_renderer(
    SceneDescription scene, const RenderSettings& settings, const BuildOptions& options,
    const std::function<void(const std::string&)>& warn) {
  auto renderer = std::make_shared<SceneRenderer>(std::move(scene), settings, options);
  for (const std::string& line : renderer->warnings()) warn(line);
  return renderer;
}

}  // namespace lightmill::agent
