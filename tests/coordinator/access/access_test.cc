// Every RPC has its line in the table of roles, and the table names nothing else.
#include "coordinator/access/access.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "lightmill/v1/client.pb.h"
#include "lightmill/v1/sequence.pb.h"
#include "lightmill/v1/thin_client.pb.h"
#include "lightmill/v1/worker.pb.h"

namespace lightmill {
namespace {

std::set<std::string> methods(const std::string& service) {
  std::set<std::string> paths;
  const google::protobuf::ServiceDescriptor* const found =
      google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
  if (!found) return paths;
  for (int i = 0; i < found->method_count(); ++i)
    paths.insert("/" + service + "/" + found->method(i)->name());
  return paths;
}

TEST(Access, EveryRpcHasRoles) {
  v1::JobStatus::descriptor();  // so that the files are linked
  v1::SequenceStatus::descriptor();
  std::set<std::string> all = methods("lightmill.v1.ClientService");
  v1::PutBlobRequest::descriptor();
  all.merge(methods("lightmill.v1.ThinClientService"));
  all.merge(methods("lightmill.v1.WorkerService"));
  all.merge(methods("lightmill.v1.SequenceService"));
  ASSERT_GT(all.size(), 20u);
  for (const std::string& path : all) {
    const AccessRule* const rule = access_rule(path);
    ASSERT_NE(rule, nullptr) << path
                             << " has no line in coordinator/access/access.cc: decide who may call it";
    EXPECT_FALSE(rule->everybody) << path << " needs a token";
    EXPECT_NE(rule->roles, 0u) << path;
    EXPECT_EQ(may(*rule, Role::kWorker), path.starts_with("/lightmill.v1.WorkerService/")) << path;
  }
  for (const AccessRule& rule : access_rules()) {
    EXPECT_TRUE(!rule.path.starts_with("/lightmill.") || all.contains(std::string(rule.path))) << rule.path;
  }
}

TEST(Access, ObserversChangeNothing) {
  const std::set<std::string_view> looking = {"GetJob",      "ListJobs", "ListTiles",
                                              "ListWorkers", "WatchJob", "FetchImage",
                                              "GetCurve",    "GetLogs",  "GetPicture"};
  std::set<std::string> all = methods("lightmill.v1.ClientService");
  all.merge(methods("lightmill.v1.ThinClientService"));
  for (const std::string& path : all) {
    const AccessRule* const rule = access_rule(path);
    ASSERT_NE(rule, nullptr);
    const bool looks = looking.contains(std::string_view(path).substr(path.rfind('/') + 1));
    EXPECT_EQ(may(*rule, Role::kObserver), looks) << path;
    EXPECT_TRUE(may(*rule, Role::kSubmitter) && may(*rule, Role::kAdmin)) << path;
  }
}

TEST(Access, RolesHaveNames) {
  for (const Role role : {Role::kSubmitter, Role::kWorker, Role::kObserver, Role::kAdmin})
    EXPECT_EQ(role_from_name(role_name(role)), role);
  EXPECT_FALSE(role_from_name("root"));
  EXPECT_EQ(roles_text(*access_rule("/lightmill.v1.ClientService/SubmitJob")), "submitter or admin");
  EXPECT_EQ(access_rule("/lightmill.v1.ClientService/Nothing"), nullptr);
  EXPECT_EQ(access_rule(""), nullptr);
}

}  // namespace
}  // namespace lightmill
