#include "common/scene/bundle.h"

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/scene/scene_files.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

constexpr const char* kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement "
    "face 1\n"
    "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

TEST(BundleNames, DependOnTheTextAlone) {
  EXPECT_EQ(bundle_name("models/a.ply"), "models/a.ply");
  EXPECT_EQ(bundle_name("./models//x/../a.ply"), "models/a.ply");
  EXPECT_EQ(bundle_name("with space.png"), "with space.png");
  for (const char* outside :
       {"/abs/a.ply", "../a.ply", "x/../../a.ply", "external/1/a.ply", "C:\\job\\a.ply"}) {
    const std::string name = bundle_name(outside);
    EXPECT_TRUE(name.starts_with("external/") && name.ends_with("/a.ply")) << name;
    EXPECT_TRUE(is_safe_bundle_name(name));
    EXPECT_EQ(name, bundle_name(outside));
  }
  EXPECT_NE(bundle_name("/abs/a.ply"), bundle_name("../a.ply"));
  for (const char* odd : {"/", "..", ".", "a\nb", "\xff\xfe", "a\\b", ""})
    EXPECT_TRUE(is_safe_bundle_name(bundle_name(odd))) << odd;
  EXPECT_TRUE(is_safe_bundle_name("\xc3\xa9t\xc3\xa9.png"));
}

class Bundles : public SceneTest {
 protected:
  /// Copies the blobs of a bundle into a folder, as a worker's cache holds them.
  static void store(const Bundle& bundle, const std::map<std::string, std::string>& paths,
                    const TempFolder& cache) {
    for (const BundleEntry& e : bundle.entries) {
      std::filesystem::copy_file(paths.at(e.digest), std::filesystem::path(cache.path()) / blob_file_name(e),
                                 std::filesystem::copy_options::skip_existing);
    }
  }
};

TEST_F(Bundles, AWorkerReadsTheSameSceneFromBlobs) {
  TempFolder elsewhere;
  const std::string outside = elsewhere.write("far.ply", kPly);
  folder_.write("models/near.ply", kPly);
  folder_.write("inc/part.pbrt", "Shape \"plymesh\" \"string filename\" \"models/near.ply\"\n");
  folder_.write("tex/wood.tga", "pixels");
  const SceneDescription scene = clean_world(
      "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"./tex/wood.tga\"\n"
      "Material \"diffuse\" \"texture reflectance\" \"t\"\n"
      "Include \"inc/part.pbrt\"\nShape \"plymesh\" \"string filename\" \"" +
      outside + "\"\n");
  std::map<std::string, std::string> paths;
  const Bundle bundle = make_bundle(scene, &paths);
  EXPECT_EQ(bundle.main, "scene.pbrt");
  ASSERT_EQ(bundle.entries.size(), 5u);
  EXPECT_EQ(bundle_to_json(bundle).find(elsewhere.path()), std::string::npos) << "no machine path";

  const Bundle received = bundle_from_json(bundle_to_json(bundle));
  EXPECT_EQ(received.entries, bundle.entries);
  EXPECT_EQ(received.digest(), bundle.digest());
  TempFolder cache;
  store(received, paths, cache);
  const LoadResult loaded = load_scene(received.main, BundleFiles(received, cache.path()));
  const SceneDescription copy = clean(loaded);
  EXPECT_EQ(copy.shapes.size(), 2u);
  EXPECT_TRUE(std::get<ImageTexture>(copy.textures.at(0).kind).path.ends_with(".tga"));
  EXPECT_EQ(make_bundle(copy, nullptr).digest(), bundle.digest());
}

/// Images that are seen by each way there is, and others that nothing shows.
constexpr const char* kImages = R"(
Texture "base" "spectrum" "imagemap" "string filename" "base.png"
Texture "tint" "spectrum" "scale" "texture tex" "base"
Texture "mask" "float" "imagemap" "string filename" "mask.png"
Texture "height" "float" "imagemap" "string filename" "height.png"
Texture "idle" "spectrum" "imagemap" "string filename" "idle.png"
Texture "idler" "spectrum" "scale" "texture tex" "idle"
MakeNamedMaterial "seen" "string type" "diffuse" "texture reflectance" "tint" "string normalmap" "bumps.png"
MakeNamedMaterial "also" "string type" "diffuse" "texture displacement" "height"
MakeNamedMaterial "both" "string type" "mix" "string materials" ["seen" "also"]
MakeNamedMaterial "unseen" "string type" "diffuse" "texture reflectance" "idler" "string normalmap" "flat.png"
AttributeBegin
  AreaLightSource "diffuse" "string filename" "sign.png"
  NamedMaterial "both"
  Shape "sphere" "texture alpha" "mask"
AttributeEnd
AttributeBegin
  AreaLightSource "diffuse" "string filename" "off.png"
AttributeEnd
ObjectBegin "nowhere"
  NamedMaterial "unseen"
  Shape "sphere"
ObjectEnd
)";

TEST_F(Bundles, HoldTheImagesThatSomethingShows) {
  for (const char* name : {"base", "mask", "height", "idle", "bumps", "flat", "sign", "off"})
    folder_.write(std::string(name) + ".png", name);
  std::map<std::string, std::string> paths;
  const Bundle bundle = make_bundle(clean_world(kImages), &paths);
  std::vector<std::string> names;
  for (const BundleEntry& e : bundle.entries) names.push_back(e.name);
  EXPECT_EQ(names, (std::vector<std::string>{"base.png", "bumps.png", "height.png", "mask.png", "scene.pbrt",
                                             "sign.png"}));
  TempFolder cache;
  store(bundle, paths, cache);
  const SceneDescription copy = clean(load_scene(bundle.main, BundleFiles(bundle, cache.path())));
  EXPECT_EQ(make_bundle(copy, nullptr).digest(), bundle.digest());
}

TEST_F(Bundles, WithoutAnImageThatIsSeenAreRefused) {
  for (const char* name : {"base", "mask", "height", "idle", "bumps", "flat", "sign", "off"})
    folder_.write(std::string(name) + ".png", name);
  std::map<std::string, std::string> paths;
  const Bundle whole = make_bundle(clean_world(kImages), &paths);
  TempFolder cache;
  store(whole, paths, cache);
  for (const BundleEntry& gone : whole.entries) {
    if (gone.name == whole.main) continue;
    Bundle lacking = whole;
    std::erase(lacking.entries, gone);
    const LoadResult loaded = load_scene(lacking.main, BundleFiles(lacking, cache.path()));
    EXPECT_TRUE(has_error(loaded, "is missing; submit the scene again")) << gone.name;
  }
}

TEST_F(Bundles, HoldTheMeshesOfObjectsThatAreSomewhere) {
  for (const char* name : {"seen", "unseen", "both"}) folder_.write(std::string(name) + ".ply", kPly);
  std::map<std::string, std::string> paths;
  const SceneDescription scene = clean_world(R"(
    ObjectBegin "a" Shape "plymesh" "string filename" "seen.ply" ObjectEnd
    ObjectBegin "b"
      Shape "plymesh" "string filename" "unseen.ply"
      Shape "plymesh" "string filename" "both.ply"
    ObjectEnd
    Shape "plymesh" "string filename" "both.ply"
    ObjectInstance "a" Translate 1 0 0 ObjectInstance "a")");
  Bundle bundle = make_bundle(scene, &paths);
  std::vector<std::string> names;
  for (const BundleEntry& e : bundle.entries) names.push_back(e.name);
  EXPECT_EQ(names, (std::vector<std::string>{"both.ply", "scene.pbrt", "seen.ply"}));
  TempFolder cache;
  store(bundle, paths, cache);
  const SceneDescription copy = clean(load_scene(bundle.main, BundleFiles(bundle, cache.path())));
  EXPECT_EQ(copy.instances.size(), 2u);
  EXPECT_EQ(make_bundle(copy, nullptr).digest(), bundle.digest());
  bundle.entries.pop_back();  // seen.ply
  EXPECT_TRUE(has_error(load_scene(bundle.main, BundleFiles(bundle, cache.path())),
                        "a mesh of the object \"a\" is missing"));
}

TEST_F(Bundles, AFolderMustHoldUnusedImagesToo) {
  const LoadResult loaded =
      load_world("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"typo.png\"\n");
  EXPECT_TRUE(refused_on_line_2(loaded, "there is no file \"typo.png\""));
}

TEST_F(Bundles, ContentChangesTheDigest) {
  const std::string before = make_bundle(clean_world(""), nullptr).digest();
  EXPECT_EQ(make_bundle(clean_world(""), nullptr).digest(), before);
  EXPECT_NE(make_bundle(clean_world("# other"), nullptr).digest(), before);
}

TEST_F(Bundles, OnlyWhatIsInTheBundleResolves) {
  const Bundle bundle = make_bundle(clean_world(""), nullptr);
  const BundleFiles files(bundle, "/cache");
  EXPECT_EQ(files.resolve("scene.pbrt"), "/cache/" + bundle.entries[0].digest + ".pbrt");
  for (const char* name : {"", "/etc/passwd", "../secret", "other.ply"}) EXPECT_EQ(files.resolve(name), "");
}

TEST(BundleText, UnsafeInputIsRefused) {
  const std::string digest = sha256_hex("x");
  const Bundle good{"a.pbrt", "", "", {{"a.pbrt", digest, 1}, {"b.ply", digest, 1}}};
  EXPECT_EQ(bundle_from_json(bundle_to_json(good)).entries, good.entries);
  std::vector<Bundle> bad(10, good);
  bad[9].environment = "c.exr";
  bad[0].main = "c.pbrt";
  bad[1].entries[1].name = "../b.ply";
  bad[2].entries[1].name = "/b.ply";
  bad[3].entries[1].digest = "../../etc/passwd";
  bad[4].entries[1].name = "a.pbrt";
  std::swap(bad[5].entries[0], bad[5].entries[1]);
  bad[6].entries.clear();
  bad[7].entries[1].name = "b//c";
  bad[8].entries[1].name = "b\n";
  for (const Bundle& b : bad) EXPECT_THROW(bundle_from_json(bundle_to_json(b)), Error) << bundle_to_json(b);
  for (const char* text : {"", "{}", "[]", "{\"version\":2}", "{\"version\":1,\"main\":1,\"entries\":[]}",
                           "{\"version\":1,\"main\":\"a\",\"entries\":{}}"}) {
    EXPECT_THROW(bundle_from_json(text), Error) << text;
  }
}

TEST(BundleText, ThePoseIsPartOfTheScene) {
  const std::string digest = sha256_hex("x");
  const Bundle still{"a.glb", "", "", {{"a.glb", digest, 1}}};
  Bundle posed = still;
  posed.pose = {"Run", 1.0 / 3, -0.25 / 24, 0.1};
  EXPECT_NE(posed.digest(), still.digest());
  EXPECT_EQ(bundle_from_json(bundle_to_json(posed)).pose, posed.pose) << "to the last bit";
  EXPECT_EQ(load_options(posed).pose, posed.pose);
  EXPECT_EQ(bundle_to_json(still).find("pose"), std::string::npos)
      << "digests of scenes that stand are as before";
  posed.pose = {"", 0, 0, 0};
  EXPECT_TRUE(bundle_from_json(bundle_to_json(posed)).pose.time.has_value())
      << "time 0 is not the pose of the file";
  const std::string text = bundle_to_json(posed);
  const auto with = [&](const std::string& pose) {
    const size_t at = text.find("{\"time\":0.0}");
    return std::string(text).replace(at, 12, pose);
  };
  ASSERT_NO_THROW(bundle_from_json(with("{}")));
  for (const char* pose : {"5", "{\"time\":\"x\"}", "{\"time\":1e999}", "{\"shutter\":[1,0]}",
                           "{\"shutter\":[1]}", "{\"shutter\":5}", "{\"animation\":5}"})
    EXPECT_THROW(bundle_from_json(with(pose)), Error) << pose;
}

TEST(BundleText, BlobNamesKeepPlainExtensionsOnly) {
  const std::string d = sha256_hex("x");
  EXPECT_EQ(blob_file_name({"a/b.exr", d, 1}), d + ".exr");
  EXPECT_EQ(blob_file_name({"a.b/c", d, 1}), d);
  EXPECT_EQ(blob_file_name({"c.e x", d, 1}), d);
  EXPECT_EQ(blob_file_name({"m.ply.gz", d, 1}), d + ".gz");
}

}  // namespace
}  // namespace lightmill
