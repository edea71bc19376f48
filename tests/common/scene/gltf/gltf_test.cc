// glTF scenes: containers, accessors, hierarchies, cameras and lights.
#include <cmath>
#include <limits>
#include <numbers>

#include "common/job/settings.h"
#include "common/scene/bundle.h"
#include "common/scene/scene_files.h"
#include "common/scene/transform.h"
#include "tests/common/scene/gltf/gltf_fixture.h"

namespace lightmill {
namespace {

using nlohmann::json;

TEST_F(GltfTest, ASquareBeforeACamera) {
  const SceneDescription s = clean_document();
  ASSERT_EQ(s.shapes.size(), 1u);
  const TriangleMesh& mesh = mesh_of(s);
  ASSERT_EQ(mesh.positions.size(), 4u);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.positions[2].x, 1);
  EXPECT_EQ(mesh.normals[0].z, 1);
  EXPECT_EQ(mesh.uvs[0].y, 0) << "v points up";
  ASSERT_EQ(s.area_lights.size(), 1u);
  EXPECT_EQ(s.area_lights[0].radiance, (Rgb{1, 1, 1}));
  EXPECT_FALSE(s.area_lights[0].two_sided);
  EXPECT_EQ(s.film.width, 1280);
  EXPECT_EQ(s.film.height, 640);
  EXPECT_EQ(s.sampling.max_depth, kUnlimitedDepth);
  EXPECT_EQ(s.film.filename, "scene.exr");
}

TEST_F(GltfTest, CamerasLookAlongMinusZ) {
  const SceneDescription s = clean_document();
  EXPECT_NEAR(s.camera.fov_degrees, 0.8 * 180 / std::numbers::pi, 1e-9);
  const Vec3d eye = transform_point(s.camera.camera_to_world, {0, 0, 0});
  EXPECT_EQ(eye.z, 5);
  const Vec3d ahead = transform_vector(s.camera.camera_to_world, {0, 0, 1});
  EXPECT_EQ(ahead.z, -1);
  const Vec3d right = transform_vector(s.camera.camera_to_world, {1, 0, 0});
  EXPECT_EQ(right.x, 1);
}

TEST_F(GltfTest, HiddenNodesHideWhatIsBelowThem) {
  document_["scenes"][0]["nodes"] = {2, 3};
  document_["nodes"].push_back(
      {{"children", {0, 1}}, {"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}});
  document_["nodes"].push_back({{"mesh", 0}, {"extensions", {{"KHR_node_visibility", {{"visible", true}}}}}});
  document_["extensionsRequired"] = {"KHR_node_visibility"};
  const SceneDescription s = clean_document();
  EXPECT_EQ(s.shapes.size(), 1u);
  EXPECT_EQ(transform_point(s.camera.camera_to_world, {0, 0, 0}).z, 5) << "a camera is no sight";
}

TEST_F(GltfTest, AFieldOfViewIsOfTheHeight) {
  document_["cameras"][0]["perspective"]["aspectRatio"] = 0.5;
  const SceneDescription s = clean_document();
  EXPECT_EQ(s.film.width, 640);
  EXPECT_EQ(s.film.height, 1280);
  EXPECT_NEAR(std::tan(s.camera.fov_degrees * std::numbers::pi / 360), std::tan(0.4) / 2, 1e-9);
}

TEST_F(GltfTest, OrthographicCamerasAndScaledNodes) {
  document_["cameras"][0] = {{"type", "orthographic"},
                             {"orthographic", {{"xmag", 3}, {"ymag", 2}, {"znear", 0}, {"zfar", 9}}}};
  document_["nodes"][1]["scale"] = {7, 7, 7};
  const SceneDescription s = clean_document();
  EXPECT_EQ(s.camera.kind, CameraKind::kOrthographic);
  EXPECT_EQ(*s.camera.screen_window, (std::array<double, 4>{-3, 3, -2, 2}));
  EXPECT_EQ(transform_vector(s.camera.camera_to_world, {1, 0, 0}).x, 1) << "a camera has no scale";
}

TEST_F(GltfTest, CamerasAreChosenByName) {
  document_["cameras"].push_back(
      {{"type", "perspective"}, {"name", "lens"}, {"perspective", {{"yfov", 1.0}}}});
  document_["nodes"].push_back({{"camera", 1}, {"name", "side"}});
  document_["scenes"][0]["nodes"].push_back(2);
  EXPECT_TRUE(mentions(load_document(), "there are several cameras"));
  for (const char* name : {"side", "lens"})
    EXPECT_NEAR(clean(load_document({false, name, ""})).camera.fov_degrees, 180 / std::numbers::pi, 1e-9);
  EXPECT_TRUE(has_error(load_document({false, "back", ""}), "no camera of the scene is called \"back\""));
}

TEST_F(GltfTest, WithoutACameraTheSceneIsFramed) {
  document_["nodes"][1].erase("camera");
  const LoadResult r = load_document();
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "no camera"));
  const Transform world_to_camera = inverse(r.scene.camera.camera_to_world);
  const Vec3d middle = transform_point(world_to_camera, {0.5, 0.5, 0});
  EXPECT_NEAR(middle.x, 0, 1e-9);
  EXPECT_NEAR(middle.y, 0, 1e-9);
  EXPECT_GT(middle.z, 0.5);
  const Vec3d right = transform_point(world_to_camera, {1, 0.5, 0});
  EXPECT_GT(right.x, 0) << "not mirrored";
}

TEST_F(GltfTest, WithoutALightTheSceneIsLit) {
  document_["materials"][0].erase("emissiveFactor");
  const LoadResult r = load_document();
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "--environment"));
  ASSERT_EQ(r.scene.lights.size(), 2u);
  EXPECT_LT(std::get<DistantLight>(r.scene.lights[0].kind).direction.y, 0) << "from above";
  EXPECT_TRUE(std::holds_alternative<InfiniteLight>(r.scene.lights[1].kind));
}

TEST_F(GltfTest, WhatOnlyGlowsIsLitToo) {
  const auto lights = [&] {
    const LoadResult r = load_document();
    EXPECT_TRUE(r.ok()) << listed(r);
    const bool lit = !r.scene.lights.empty();
    EXPECT_EQ(mentions(r, "the scene has no light but surfaces that glow; it is lit by a grey sky"), lit);
    return r.scene.lights.size();
  };
  EXPECT_EQ(lights(), 0u) << "a lamp";
  document_["materials"].push_back(nlohmann::json::object());
  document_["meshes"].push_back(document_["meshes"][0]);
  document_["meshes"][1]["primitives"][0]["material"] = 1;
  document_["nodes"].push_back({{"mesh", 1}, {"scale", {5, 5, 5}}});
  document_["scenes"][0]["nodes"].push_back(2);
  EXPECT_EQ(lights(), 0u) << "in a room of 25 times its area";
  document_["nodes"][2]["scale"] = {10, 10, 10};
  EXPECT_EQ(lights(), 2u) << "of 100 times: a light of a car";
  document_["materials"][0]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 17;
  EXPECT_EQ(lights(), 0u);
  // Most models have a texture of emission.
  document_["nodes"][2]["scale"] = {0.1, 0.1, 0.1};
  folder_.write("glow.png", "not read by the reader");
  document_["images"] = {{{"uri", "glow.png"}}};
  document_["textures"] = {{{"source", 0}}};
  document_["materials"][0]["emissiveTexture"]["index"] = 0;
  EXPECT_EQ(lights(), 0u) << "a strength of 17";
  document_["materials"][0].erase("extensions");
  EXPECT_EQ(lights(), 2u);
  document_["materials"][1]["extensions"]["KHR_materials_unlit"] = nlohmann::json::object();
  document_["materials"][0] = document_["materials"][1];
  EXPECT_EQ(lights(), 0u) << "nothing needs light";
}

TEST_F(GltfTest, AnEnvironmentIsPartOfTheBundle) {
  const std::string sky = folder_.write("elsewhere/sky.exr", "pixels");
  const SceneDescription s = clean(load_document({false, "front", sky}));
  ASSERT_EQ(s.lights.size(), 1u);
  const auto& light = std::get<InfiniteLight>(s.lights[0].kind);
  EXPECT_EQ(light.image_path, sky);
  EXPECT_TRUE(light.lat_long);
  EXPECT_EQ(s.files.size(), 2u);
  const Bundle bundle = bundle_from_json(bundle_to_json(make_bundle(s, nullptr)));
  EXPECT_EQ(bundle.environment, bundle_name(sky));
  EXPECT_EQ(bundle.camera, "front");
  // From the blobs, as a worker loads it.
  std::map<std::string, std::string> paths;
  make_bundle(s, &paths);
  TempFolder blobs;
  for (const BundleEntry& e : bundle.entries)
    std::filesystem::copy_file(paths.at(e.digest), blobs.path() + "/" + blob_file_name(e));
  const LoadResult again =
      load_scene(bundle.main, BundleFiles(bundle, blobs.path()), {false, bundle.camera, bundle.environment});
  EXPECT_EQ(listed(again), "");
  ASSERT_EQ(again.scene.lights.size(), 1u);
  EXPECT_TRUE(std::get<InfiniteLight>(again.scene.lights[0].kind).image_path.ends_with(".exr"));
  EXPECT_TRUE(has_error(load_document({false, "", "none.exr"}), "no file \"none.exr\""));
}

TEST_F(GltfTest, GlbCarriesItsBuffer) {
  document_["buffers"][0].erase("uri");
  folder_.write("scene.glb", glb(document_, square_));
  const SceneDescription s = clean(load_scene("scene.glb", DirectoryFiles(folder_.path())));
  EXPECT_EQ(mesh_of(s).triangles.size(), 2u);
}

TEST_F(GltfTest, BuffersBesideTheFileAreBundled) {
  document_["buffers"][0]["uri"] = "a%20buffer.bin";
  folder_.write("a buffer.bin", square_);
  const SceneDescription s = clean_document();
  ASSERT_EQ(s.files.size(), 2u);
  EXPECT_EQ(s.files[1].name, "a buffer.bin");
  // The same from the blobs of the bundle.
  std::map<std::string, std::string> paths;
  const Bundle bundle = make_bundle(s, &paths);
  TempFolder blobs;
  for (const BundleEntry& e : bundle.entries)
    std::filesystem::copy_file(paths.at(e.digest), blobs.path() + "/" + blob_file_name(e));
  const LoadResult again = load_scene(bundle.main, BundleFiles(bundle, blobs.path()));
  EXPECT_EQ(listed(again), "");
  EXPECT_EQ(mesh_of(again.scene).triangles.size(), 2u);
}

TEST_F(GltfTest, EveryComponentType) {
  const auto positions = [&](int accessor, bool normalized) {
    primitive()["attributes"]["POSITION"] = accessor;
    document_["accessors"][static_cast<size_t>(accessor)]["normalized"] = normalized;
    return mesh_of(clean_document()).positions;
  };
  const auto signed_bytes = raw_bytes<int8_t>({0, 0, 0, 127, 0, 0, 127, 127, 0, -128, 127, 0});
  EXPECT_EQ(positions(add_accessor(signed_bytes, 5120, 4, "VEC3"), false)[3].x, -128);
  EXPECT_EQ(positions(add_accessor(signed_bytes, 5120, 4, "VEC3"), true)[3].x, -1);
  const auto bytes = raw_bytes<uint8_t>({0, 0, 0, 255, 0, 0, 255, 255, 0, 0, 51, 0});
  EXPECT_NEAR(positions(add_accessor(bytes, 5121, 4, "VEC3"), true)[3].y, 0.2, 1e-7);
  const auto shorts = raw_bytes<int16_t>({0, 0, 0, 32767, 0, 0, 32767, 32767, 0, -32768, 32767, 0});
  EXPECT_EQ(positions(add_accessor(shorts, 5122, 4, "VEC3"), true)[3].x, -1);
  const auto words = raw_bytes<uint16_t>({0, 0, 0, 65535, 0, 0, 65535, 65535, 0, 0, 13107, 0});
  EXPECT_NEAR(positions(add_accessor(words, 5123, 4, "VEC3"), true)[3].y, 0.2, 1e-7);
}

TEST_F(GltfTest, StridesAndOffsets) {
  std::vector<float> interleaved;
  for (const auto& [x, y] : std::vector<std::pair<float, float>>{{0, 0}, {1, 0}, {1, 1}, {0, 1}})
    interleaved.insert(interleaved.end(), {9, x, y, 0, 9});
  const int a = add_accessor(raw_bytes(interleaved), 5126, 4, "VEC3");
  document_["accessors"][static_cast<size_t>(a)]["byteOffset"] = 4;
  document_["bufferViews"].back()["byteStride"] = 20;
  primitive()["attributes"]["POSITION"] = a;
  EXPECT_EQ(mesh_of(clean_document()).positions[2].y, 1);
  document_["accessors"][static_cast<size_t>(a)]["byteOffset"] = 12;
  EXPECT_TRUE(has_error(load_document(), "/accessors/4: its 4 elements reach beyond"));
}

TEST_F(GltfTest, SparseAccessorsReplaceElements) {
  const int indices = add_accessor(raw_bytes<uint8_t>({1, 3}), 5121, 2, "SCALAR");
  const int values = add_accessor(raw_bytes<float>({5, 0, 0, 0, 6, 0}), 5126, 2, "VEC3");
  auto& a = document_["accessors"][0];
  const auto view = [&](int accessor) {
    return document_["accessors"][static_cast<size_t>(accessor)]["bufferView"];
  };
  a["sparse"] = {{"count", 2},
                 {"indices", {{"bufferView", view(indices)}, {"componentType", 5121}}},
                 {"values", {{"bufferView", view(values)}}}};
  const auto positions = mesh_of(clean_document()).positions;
  EXPECT_EQ(positions[1].x, 5);
  EXPECT_EQ(positions[2].x, 1);
  EXPECT_EQ(positions[3].y, 6);
  a["sparse"]["count"] = 5;
  EXPECT_TRUE(has_error(load_document(), "/accessors/0/sparse/count: must be a number from 0 to 4"));
}

TEST_F(GltfTest, StripsAndFans) {
  primitive()["indices"] = add_accessor(raw_bytes<uint8_t>({0, 1, 3, 2}), 5121, 4, "SCALAR");
  primitive()["mode"] = 5;
  const auto facing = [&] {
    const SceneDescription s = clean_document();
    const TriangleMesh& m = mesh_of(s);
    for (const auto& t : m.triangles) {
      const Vec3f a = m.positions[t[0]], b = m.positions[t[1]], c = m.positions[t[2]];
      EXPECT_GT((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x), 0);
    }
    return m.triangles.size();
  };
  EXPECT_EQ(facing(), 2u);
  primitive()["indices"] = add_accessor(raw_bytes<uint32_t>({0, 1, 2, 3}), 5125, 4, "SCALAR");
  primitive()["mode"] = 6;
  EXPECT_EQ(facing(), 2u);
}

TEST_F(GltfTest, PointsAreSmallSpheresAndLinesThinTubes) {
  primitive().erase("indices");
  primitive()["mode"] = 0;
  LoadResult r = load_document();
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "points are shown as small spheres"));
  EXPECT_EQ(mesh_of(r.scene).triangles.size(), 4u * 20);
  const double radius = std::sqrt(2.0) / 500;
  for (size_t i = 0; i < mesh_of(r.scene).positions.size(); ++i) {
    const Vec3f p = mesh_of(r.scene).positions[i], n = mesh_of(r.scene).normals[i];
    EXPECT_NEAR(n.x * n.x + n.y * n.y + n.z * n.z, 1, 1e-5);
    EXPECT_NEAR(std::abs(p.z), std::abs(n.z) * radius, 1e-6);
  }
  // Pairs, a loop, a strip; of indices, too.
  for (const auto& [mode, segments] : {std::pair{1, 2u}, {2, 4u}, {3, 3u}}) {
    primitive()["mode"] = mode;
    r = load_document();
    EXPECT_TRUE(r.ok());
    EXPECT_TRUE(mentions(r, "lines are shown as thin tubes"));
    EXPECT_EQ(mesh_of(r.scene).triangles.size(), segments * 6) << mode;
  }
  // A segment without length, one to nowhere, and one that is seen.
  primitive()["mode"] = 1;
  primitive()["indices"] = add_accessor(raw_bytes<uint16_t>({0, 0, 0, 9, 0, 1}), 5123, 6, "SCALAR");
  EXPECT_EQ(mesh_of(load_document().scene).triangles.size(), 6u);
}

TEST_F(GltfTest, OnlyVerticesInUseAreKept) {
  primitive()["indices"] = add_accessor(raw_bytes<uint16_t>({0, 2, 3}), 5123, 3, "SCALAR");
  EXPECT_EQ(mesh_of(clean_document()).positions.size(), 3u);
}

TEST_F(GltfTest, VertexColoursMultiplyTheBase) {
  primitive()["attributes"]["COLOR_0"] = add_accessor(
      raw_bytes<uint8_t>({255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 51, 0, 0, 0, 0}), 5121, 4, "VEC4");
  document_["accessors"].back()["normalized"] = true;
  const SceneDescription s = clean_document();
  EXPECT_NEAR(mesh_of(s).colors[2][3], 0.2, 1e-6);
  const auto& m = std::get<MetallicRoughnessMaterial>(s.materials[0].kind);
  ASSERT_GE(m.base_color.texture, 0);
  EXPECT_TRUE(
      std::holds_alternative<ProductTexture>(s.textures[static_cast<size_t>(m.base_color.texture)].kind));
}

TEST_F(GltfTest, HierarchiesMultiplyInDouble) {
  document_["nodes"][0] = {{"children", {2}}, {"translation", {1e9, 0, 0}}};
  document_["nodes"].push_back({{"children", {3}}, {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}});
  document_["nodes"].push_back({{"mesh", 0}, {"translation", {0.001, 0, 0}}, {"scale", {2, 2, -2}}});
  const SceneDescription s = clean_document();
  const Vec3d p = transform_point(s.shapes.at(0).object_to_world, {1, 0, 1});
  EXPECT_NEAR(p.x, 1e9, 1e-6);
  EXPECT_NEAR(p.y, 2.001, 1e-9);
  EXPECT_NEAR(p.z, -2, 1e-12);
  EXPECT_TRUE(surface_flips_normal(s.shapes[0])) << "the front stays the front under a mirror";
}

TEST_F(GltfTest, MatricesAreColumnByColumn) {
  document_["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 4, 5, 1};
  EXPECT_EQ(clean_document().shapes.at(0).object_to_world.m[1][3], 4);
  document_["nodes"][0]["matrix"][15] = 2;
  EXPECT_TRUE(mentions(load_document(), "/nodes/0/matrix: must have 0 0 0 1 as its last row"));
}

TEST_F(GltfTest, NodesShareMeshes) {
  document_["nodes"].push_back({{"mesh", 0}});
  document_["scenes"][0]["nodes"].push_back(2);
  const SceneDescription s = clean_document();
  EXPECT_TRUE(s.shapes.empty());
  ASSERT_EQ(s.objects.size(), 1u);
  EXPECT_EQ(s.objects[0].shapes.size(), 1u);
  ASSERT_EQ(s.instances.size(), 2u);
  EXPECT_EQ(s.instances[1].object, 0);
}

TEST_F(GltfTest, Instances) {
  const int t = add_accessor(raw_bytes<float>({0, 0, 0, 3, 0, 0, 0, 4, 0}), 5126, 3, "VEC3");
  const int r = add_accessor(raw_bytes<int8_t>({0, 0, 0, 127, 0, 0, 127, 0, 0, 0, 0, 127}), 5120, 3, "VEC4");
  document_["accessors"][static_cast<size_t>(r)]["normalized"] = true;
  document_["nodes"][0]["translation"] = {0, 0, 1};
  document_["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", t},
                                                                                  {"ROTATION", r}};
  const SceneDescription s = clean_document();
  ASSERT_EQ(s.instances.size(), 3u);
  const Vec3d p = transform_point(s.instances[1].object_to_world, {1, 0, 0});
  EXPECT_NEAR(p.x, 2, 1e-6) << "turned by half a turn about z";
  EXPECT_NEAR(p.z, 1, 1e-6);
}

TEST_F(GltfTest, PunctualLights) {
  document_["extensions"]["KHR_lights_punctual"]["lights"] = json::parse(R"([
    {"type": "point", "color": [1, 0.5, 0], "intensity": 10},
    {"type": "spot", "intensity": 3, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}},
    {"type": "directional"}])");
  for (int i = 0; i < 3; ++i) {
    document_["nodes"].push_back({{"translation", {1, 2, 3}},
                                  {"rotation", {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}},  // -z to +y
                                  {"scale", {5, 5, 5}},
                                  {"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
    document_["scenes"][0]["nodes"].push_back(2 + i);
  }
  const SceneDescription s = clean_document();
  ASSERT_EQ(s.lights.size(), 3u);
  const auto& point = std::get<PointLight>(s.lights[0].kind);
  EXPECT_EQ(point.intensity, (Rgb{10, 5, 0}));
  EXPECT_EQ(point.position.z, 3);
  const auto& spot = std::get<SpotLight>(s.lights[1].kind);
  EXPECT_NEAR(spot.direction.y, 1, 1e-12);
  EXPECT_NEAR(spot.falloff_start, 0.1 * 180 / std::numbers::pi, 1e-9);
  EXPECT_NEAR(spot.total_width, 0.2 * 180 / std::numbers::pi, 1e-9);
  const auto& sun = std::get<DistantLight>(s.lights[2].kind);
  EXPECT_EQ(sun.irradiance, (Rgb{1, 1, 1}));
  EXPECT_NEAR(sun.direction.y, 1, 1e-12);
}

TEST_F(GltfTest, ScenesAreChosenAndOthersLeftOut) {
  document_["nodes"].push_back({{"mesh", 77}});
  document_["scenes"].push_back({{"nodes", {2}}});
  EXPECT_EQ(clean_document().shapes.size(), 1u);
  document_["scene"] = 1;
  EXPECT_TRUE(has_error(load_document(), "/nodes/2/mesh: refers to mesh 77, but there are 1"));
  document_["scene"] = 2;
  EXPECT_TRUE(has_error(load_document(), "/scene: refers to scene 2"));
}

}  // namespace
}  // namespace lightmill
