// Dependencies point one way: proto <- common <- {worker, coordinator} <- client. Read from the
// #include lines.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>
#include <string>
#include <vector>

namespace lightmill {
namespace {

namespace fs = std::filesystem;

struct Include {
  std::string file;  // relative to the root, '/' separated
  int line;
  std::string target;
};

std::vector<Include> includes_under(const std::string& folder) {
  std::vector<Include> found;
  const fs::path root(LIGHTMILL_SOURCE_DIR);
  const std::regex pattern(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".h" && extension != ".cc") continue;
    std::ifstream in(entry.path());
    std::string text;
    for (int line = 1; std::getline(in, text); ++line) {
      std::smatch match;
      if (std::regex_search(text, match, pattern)) {
        found.push_back({fs::relative(entry.path(), root).generic_string(), line, match[1]});
      }
    }
  }
  return found;
}

void expect_none(const std::string& folder, const std::string& rule,
                 const std::function<bool(const Include&)>& is_forbidden) {
  const std::vector<Include> all = includes_under(folder);
  EXPECT_GT(all.size(), 10u) << folder << " was not scanned";
  for (const Include& include : all) {
    EXPECT_FALSE(is_forbidden(include))
        << include.file << ":" << include.line << ": includes " << include.target << "; " << rule;
  }
}

bool starts_with_any(const std::string& text, std::initializer_list<const char*> prefixes) {
  for (const char* prefix : prefixes) {
    if (text.rfind(prefix, 0) == 0) return true;
  }
  return false;
}

TEST(Arrows, CommonDependsOnNothingAboveIt) {
  expect_none("common", "common/ is below worker/, coordinator/ and client/ and has no Embree",
              [](const Include& i) {
                return starts_with_any(i.target, {"worker/", "coordinator/", "client/", "embree"});
              });
}

TEST(Arrows, CoordinatorKnowsNoWorkerAndNoEmbree) {
  expect_none("coordinator", "coordinator/ contains no Embree and no worker code", [](const Include& i) {
    return starts_with_any(i.target, {"worker/", "client/", "embree"});
  });
}

TEST(Arrows, WorkerKnowsNoCoordinator) {
  expect_none("worker", "worker/ talks to the coordinator by messages only", [](const Include& i) {
    return starts_with_any(i.target, {"coordinator/", "client/"});
  });
}

/// A folder of the project, and those that it may include besides itself and what lies in it.
struct Layer {
  const char* folder;
  std::vector<std::string> below;
};

// Within common/ a folder knows those before it alone.
TEST(Arrows, FoldersOfCommonPointDown) {
  const std::vector<Layer> layers = {
      {"common/base", {}},
      {"common/build_id", {"common/film/partial.h"}},
      {"common/sandbox", {"common/base/"}},
      {"common/job", {"common/base/"}},
      {"common/image", {"common/base/", "common/build_id/", "common/job/"}},
      {"common/film", {"common/base/", "common/job/", "common/image/"}},
      {"common/error", {"common/base/", "common/build_id/", "common/job/", "common/image/", "common/film/"}},
      {"common/scene", {"common/base/", "common/job/"}},
      {"common/farm",
       {"common/base/", "common/job/", "common/image/", "common/film/", "common/error/error_curve.h",
        "common/scene/"}},
  };
  for (const Layer& layer : layers) {
    for (const Include& include : includes_under(layer.folder)) {
      if (!include.target.starts_with("common/") ||
          include.target.starts_with(std::string(layer.folder) + "/"))
        continue;
      const bool may = std::any_of(layer.below.begin(), layer.below.end(), [&](const std::string& folder) {
        return include.target.starts_with(folder);
      });
      EXPECT_TRUE(may) << include.file << ":" << include.line << ": includes " << include.target << "; "
                       << layer.folder << "/ is below it";
    }
  }
}

TEST(Arrows, ReadersDoNotKnowEachOther) {
  const std::string scene = "common/scene/";
  const std::vector<std::string> readers = {"pbrt", "gltf"};
  for (const std::string& reader : readers) {
    expect_none(scene + reader, "a reader knows no other reader", [&](const Include& i) {
      return std::any_of(readers.begin(), readers.end(), [&](const std::string& other) {
        return other != reader && i.target.starts_with(scene + other + "/");
      });
    });
  }
  for (const char* part : {"mesh", "spectrum", "measured"}) {
    for (const Include& i : includes_under(scene + part)) {
      EXPECT_FALSE(starts_with_any(i.target, {"common/scene/pbrt/", "common/scene/gltf/"}))
          << i.file << ":" << i.line << ": " << part << "/ is what readers share, and knows none of them";
    }
  }
}

// coordinator/farm decides on events and the time of the moment: it can be tested without a disk or a
// network.
TEST(Arrows, TheFarmIsPure) {
  expect_none("coordinator/farm", "coordinator/farm/ knows no store, service or HTTP", [](const Include& i) {
    return (i.target.starts_with("coordinator/") && !i.target.starts_with("coordinator/farm/")) ||
           starts_with_any(i.target, {"grpc", "lightmill/v1/", "common/rpc/", "sqlite3", "libpq", "httplib",
                                      "thread", "mutex", "fstream", "filesystem"});
  });
}

TEST(Arrows, FoldersOfTheCoordinatorPointDown) {
  const auto expect_without = [](const std::string& folder, std::initializer_list<const char*> above) {
    for (const Include& i : includes_under("coordinator/" + folder)) {
      EXPECT_FALSE(starts_with_any(i.target, above)) << i.file << ":" << i.line << ": includes " << i.target
                                                     << "; coordinator/" << folder << "/ is below it";
    }
  };
  expect_without("store",
                 {"coordinator/core/", "coordinator/merge/", "coordinator/service/", "coordinator/http/",
                  "coordinator/web/", "coordinator/access/", "grpc", "lightmill/v1/"});
  expect_without("merge", {"coordinator/core/", "coordinator/service/", "coordinator/http/",
                           "coordinator/web/", "coordinator/access/", "grpc", "lightmill/v1/"});
  expect_without("core", {"coordinator/service/", "coordinator/http/", "coordinator/web/",
                          "coordinator/hooks/", "coordinator/access/", "grpc", "lightmill/v1/"});
  expect_without("access",
                 {"coordinator/core/", "coordinator/service/", "coordinator/http/", "coordinator/web/"});
}

TEST(Arrows, TheFilmKnowsNoNetwork) {
  expect_none("common/film", "common/film/ knows no network", [](const Include& i) {
    return starts_with_any(i.target, {"grpc", "lightmill/v1/", "common/rpc/", "sys/socket", "httplib"});
  });
}

TEST(Arrows, OnlyAccelIncludesEmbree) {
  for (const char* folder : {"common", "coordinator", "worker", "client"}) {
    expect_none(folder, "only worker/render/accel/*.cc includes embree3/*.h", [](const Include& i) {
      const bool is_accel = i.file.rfind("worker/render/accel/", 0) == 0 && i.file.ends_with(".cc");
      return starts_with_any(i.target, {"embree"}) && !is_accel;
    });
  }
}

TEST(Arrows, OnlyTheModuleIncludesOpenImageIO) {
  for (const char* folder : {"common", "coordinator", "worker", "client"}) {
    expect_none(folder, "only common/image/openimageio/ includes OpenImageIO/*.h", [](const Include& i) {
      return starts_with_any(i.target, {"OpenImageIO/"}) && i.file.rfind("common/image/openimageio/", 0) != 0;
    });
  }
}

TEST(Arrows, TheRendererHasNoGrpc) {
  expect_none("worker/render", "worker/render/ has no gRPC", [](const Include& i) {
    return starts_with_any(i.target, {"grpc", "lightmill/v1/", "worker/agent/", "common/rpc/"});
  });
}

TEST(Arrows, OnlyTheGrpcLinkIncludesGrpcInTheAgent) {
  expect_none("worker/agent", "only grpc_link.cc uses gRPC", [](const Include& i) {
    return starts_with_any(i.target, {"grpc", "lightmill/v1/", "common/rpc/channel.h", "common/rpc/convert.h",
                                      "common/rpc/status.h"}) &&
           i.file != "worker/agent/grpc_link.cc";
  });
}

}  // namespace
}  // namespace lightmill
