// A coordinator with TLS and tokens: who gets in, what those are told who don't, and rotation.
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>
#include <httplib.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <sstream>
#include <thread>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/rpc/channel.h"
#include "common/rpc/tls_diagnosis.h"
#include "coordinator/access/credential_folder.h"
#include "coordinator/server.h"
#include "coordinator/store/memory_job_store.h"
#include "lightmill/v1/client.grpc.pb.h"
#include "lightmill/v1/worker.grpc.pb.h"
#include "tests/coordinator/core/fake_worker.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

std::string read_text(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

class SecureServerTest : public ::testing::Test {
 protected:
  SecureServerTest() {
    make(root, "ann", Role::kSubmitter);
    CredentialFolder(root, now).grant("obi", Role::kObserver, 30, std::nullopt, 0);
    CredentialFolder(root, now).grant("gpu", Role::kWorker, 30, std::nullopt, 0);
    start(resolve({.folder = root + "/coordinator"}, Side::kServer));
  }
  void make(const std::string& folder_path, const std::string& name, Role role) {
    CredentialFolder made(folder_path, now);
    made.init({}, 30, false);
    made.grant(name, role, 30, std::nullopt, 0);
  }
  void start(const SecurityFiles& security) {
    server.reset();
    server = std::make_unique<Server>(
        ServerOptions{.listen = "127.0.0.1:0", .http = "127.0.0.1:0", .security = security}, farm, blobs);
    address = "localhost:" + std::to_string(server->rpc_port());
  }
  /// Replaces the coordinator's certificate, before it is started.
  SecurityFiles server_files(const std::vector<std::string>& hosts, const Validity& validity) {
    const CertificateAuthority ca({read_text(root + "/ca/ca.crt"), read_text(root + "/ca/ca.key")});
    const PemPair pair = ca.issue("coordinator", hosts, validity);
    std::ofstream(folder.file("other.crt")) << pair.certificate;
    std::ofstream(folder.file("other.key")) << pair.key;
    return {"", root + "/coordinator/ca.crt", folder.file("other.crt"), folder.file("other.key"),
            root + "/coordinator/tokens"};
  }
  static SecurityFiles as(const std::string& path) { return resolve({.folder = path}, Side::kClient); }

  grpc::Status list_jobs(const SecurityFiles& files, bool wait = false) {
    const auto stub = v1::ClientService::NewStub(make_channel({address, false, files}));
    return list_jobs(*stub, wait);
  }
  static grpc::Status list_jobs(v1::ClientService::Stub& stub, bool wait = false) {
    grpc::ClientContext context;
    set_deadline(context, 30);
    context.set_wait_for_ready(wait);
    v1::ListJobsResponse response;
    return stub.ListJobs(&context, {}, &response);
  }

  const int64_t now = std::time(nullptr);
  test::TemporaryFolder folder;
  const std::string root = folder.file("farm");
  FakeClock clock;
  BlobStore blobs{folder.file("blobs")};
  Farm farm{std::make_unique<MemoryJobStore>(), clock, fake_options()};
  std::unique_ptr<Server> server;
  std::string address;
};

TEST_F(SecureServerTest, AJobBearsTheNameOfItsSubmittersToken) {
  const Bundle bundle = fake_bundle();
  BlobStore::Writer writer = blobs.begin(bundle.entries[0].digest, bundle.entries[0].size);
  writer.write("scene");
  writer.finish();
  v1::SubmitJobRequest request;
  request.set_bundle_json(bundle_to_json(bundle));
  request.set_settings_json(settings_to_json(small_settings(64, 64, 4)));
  request.set_submitter("bob, says ann");
  grpc::ClientContext context;
  set_deadline(context, 30);
  v1::SubmitJobResponse response;
  const auto stub = v1::ClientService::NewStub(make_channel({address, false, as(root + "/ann")}));
  const grpc::Status status = stub->SubmitJob(&context, request, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(farm.job(JobId{response.job_id()}).submitter, "ann");
}

TEST_F(SecureServerTest, RolesHoldOnRpcs) {
  EXPECT_TRUE(list_jobs(as(root + "/ann")).ok());
  EXPECT_TRUE(list_jobs(as(root + "/obi")).ok());
  const grpc::Status worker = list_jobs(as(root + "/gpu"));
  EXPECT_EQ(worker.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(worker.error_message(),
              HasSubstr("has the role worker; this needs submitter, observer or admin"));

  const auto channel = make_channel({address, false, as(root + "/obi")});
  grpc::ClientContext context;
  set_deadline(context, 30);
  v1::SubmitJobResponse response;
  EXPECT_EQ(v1::ClientService::NewStub(channel)->SubmitJob(&context, {}, &response).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  grpc::ClientContext second;
  set_deadline(second, 30);
  v1::RegisterResponse registered;
  EXPECT_EQ(v1::WorkerService::NewStub(channel)->Register(&second, {}, &registered).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  const JobId waiting = farm.submit(testing::small_job(32, 32, 1));
  EXPECT_THAT(
      farm.job(waiting).message,
      HasSubstr("none is connected; that of an unknown host was refused: the token \"obi\" has the role"));
  // A stream is refused before its first message, too.
  grpc::ClientContext third;
  set_deadline(third, 30);
  v1::UploadBlobsResponse uploaded;
  const auto stub = v1::ClientService::NewStub(channel);
  const auto writer = stub->UploadBlobs(&third, &uploaded);
  writer->WritesDone();
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::PERMISSION_DENIED);
}

TEST_F(SecureServerTest, StrangersAreToldWhy) {
  EXPECT_TRUE(diagnose_tls(address, as(root + "/ann")).problem.empty());

  const std::string other = folder.file("other-farm");
  make(other, "ann", Role::kSubmitter);
  const grpc::Status wrong_ca = list_jobs(as(other + "/ann"));
  EXPECT_EQ(wrong_ca.error_code(), grpc::StatusCode::UNAVAILABLE);
  TlsDiagnosis found = diagnose_tls(address, as(other + "/ann"));
  EXPECT_THAT(found.problem,
              HasSubstr("its certificate was not signed by the CA in " + other + "/ann/ca.crt"));
  EXPECT_TRUE(found.definite);

  SecurityFiles foreign = as(root + "/ann");
  foreign.cert = other + "/ann/tls.crt";
  foreign.key = other + "/ann/tls.key";
  EXPECT_EQ(list_jobs(foreign).error_code(), grpc::StatusCode::UNAVAILABLE);
  found = diagnose_tls(address, foreign);
  EXPECT_THAT(found.problem, HasSubstr("it does not accept our certificate " + foreign.cert));
  EXPECT_TRUE(found.definite);

  SecurityFiles token = as(root + "/ann");
  token.token = other + "/ann/token";
  EXPECT_EQ(list_jobs(token).error_code(), grpc::StatusCode::UNAUTHENTICATED);

  EXPECT_EQ(list_jobs({}).error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(diagnose_tls(address, {}).problem, HasSubstr("it speaks TLS; give --credentials"));

  // TLS without a certificate of one's own.
  grpc::SslCredentialsOptions one_sided;
  one_sided.pem_root_certs = read_text(root + "/ca/ca.crt");
  const auto stub = v1::ClientService::NewStub(grpc::CreateChannel(address, grpc::SslCredentials(one_sided)));
  EXPECT_EQ(list_jobs(*stub).error_code(), grpc::StatusCode::UNAVAILABLE);
  // A certificate alone, without a token.
  one_sided.pem_cert_chain = read_text(root + "/ann/tls.crt");
  one_sided.pem_private_key = read_text(root + "/ann/tls.key");
  const auto anonymous =
      v1::ClientService::NewStub(grpc::CreateChannel(address, grpc::SslCredentials(one_sided)));
  const grpc::Status refused = list_jobs(*anonymous);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(refused.error_message(), HasSubstr("this needs a token"));
}

TEST_F(SecureServerTest, CertificatesOfTheServerAreJudged) {
  start(server_files({"localhost"}, {now - 200, now - 100}));
  EXPECT_EQ(list_jobs(as(root + "/ann")).error_code(), grpc::StatusCode::UNAVAILABLE);
  TlsDiagnosis found = diagnose_tls(address, as(root + "/ann"));
  EXPECT_THAT(found.problem, HasSubstr("its certificate expired on "));
  EXPECT_TRUE(found.definite);

  start(server_files({"localhost"}, {now + 1000, now + 2000}));
  EXPECT_EQ(list_jobs(as(root + "/ann")).error_code(), grpc::StatusCode::UNAVAILABLE);
  found = diagnose_tls(address, as(root + "/ann"));
  EXPECT_THAT(found.problem, AllOf(HasSubstr("is valid only from "), HasSubstr("set the clocks")));
  EXPECT_FALSE(found.definite) << "clocks are set while workers wait";

  start(server_files({"farm.example.org"}, {now - 1000, now + 2000}));
  EXPECT_EQ(list_jobs(as(root + "/ann")).error_code(), grpc::StatusCode::UNAVAILABLE);
  found = diagnose_tls(address, as(root + "/ann"));
  EXPECT_THAT(found.problem, HasSubstr("its certificate is for farm.example.org, not for localhost"));
  EXPECT_TRUE(found.definite);

  start({});
  EXPECT_EQ(list_jobs(as(root + "/ann")).error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(diagnose_tls(address, as(root + "/ann")).problem, HasSubstr("it does not speak TLS"));
  EXPECT_TRUE(diagnose_tls(address, {}).problem.empty());
  EXPECT_TRUE(list_jobs({}).ok());
}

TEST_F(SecureServerTest, TokensRotateUnderAnOpenConnection) {
  const auto stub = v1::ClientService::NewStub(make_channel({address, false, as(root + "/ann")}));
  ASSERT_TRUE(list_jobs(*stub).ok());
  CredentialFolder(root, now).grant("ann", Role::kSubmitter, 30, std::nullopt,
                                    0);  // the old one ends at once
  EXPECT_TRUE(list_jobs(*stub).ok()) << "both sides have read their files again";
  CredentialFolder(root, now).revoke("ann");
  EXPECT_EQ(list_jobs(*stub).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_TRUE(list_jobs(as(root + "/obi")).ok());
}

TEST_F(SecureServerTest, CertificatesRotateWithoutARestart) {
  ASSERT_TRUE(list_jobs(as(root + "/ann")).ok());
  // A new authority altogether: with the old certificate the server could not be reached by its clients.
  const std::string other = folder.file("other-farm");
  make(other, "ann", Role::kSubmitter);
  for (const char* file : {"ca.crt", "tls.crt", "tls.key", "tokens"})
    std::filesystem::rename(other + "/coordinator/" + file, root + "/coordinator/" + file);
  grpc::Status status = list_jobs(as(other + "/ann"));
  for (int i = 0; i < 600 && !status.ok(); ++i) {  // files are looked at once a second
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    status = list_jobs(as(other + "/ann"));
  }
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(list_jobs(as(root + "/obi")).error_code(), grpc::StatusCode::UNAVAILABLE);

  httplib::SSLClient https("localhost", server->http_port());
  https.set_ca_cert_path((other + "/ca/ca.crt").c_str());
  https.set_bearer_token_auth(read_token(other + "/ann/token").c_str());
  const auto page = https.Get("/");
  ASSERT_TRUE(page) << to_string(page.error());
  EXPECT_EQ(page->status, 200);
}

TEST_F(SecureServerTest, PagesNeedATokenToo) {
  httplib::SSLClient https("localhost", server->http_port());
  https.set_ca_cert_path((root + "/ca/ca.crt").c_str());
  const auto status = [&](const char* path) {
    const auto response = https.Get(path);
    return response ? response->status : -1;
  };
  EXPECT_EQ(status("/healthz"), 200);
  EXPECT_EQ(status("/livez"), 200);
  for (const char* path : {"/", "/metrics", "/nothing", "/healthz/..", "//"})
    EXPECT_EQ(status(path), 401) << path;
  EXPECT_THAT(https.Get("/")->get_header_value("WWW-Authenticate"), HasSubstr("Basic realm="));
  https.set_basic_auth("anybody", read_token(root + "/obi/token").c_str());
  EXPECT_EQ(status("/"), 200);
  EXPECT_EQ(status("/metrics"), 200);
  EXPECT_EQ(status("/nothing"), 404);
  https.set_basic_auth("anybody", read_token(root + "/gpu/token").c_str());
  EXPECT_EQ(status("/metrics"), 403);
  httplib::Client plain("localhost", server->http_port());
  EXPECT_FALSE(plain.Get("/metrics"));
}

TEST_F(SecureServerTest, ObserversOfTheDashboardChangeNothing) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  const std::string path = "/api/v1/jobs/" + job.value + "/pause";
  httplib::SSLClient https("localhost", server->http_port());
  https.set_ca_cert_path((root + "/ca/ca.crt").c_str());
  const auto pause = [&] {
    const auto response = https.Post(path, {{"X-Lightmill", "1"}}, "{}", "application/json");
    return response ? response->status : -1;
  };
  EXPECT_EQ(https.Get("/api/v1/jobs")->status, 401);
  EXPECT_EQ(pause(), 401);
  https.set_basic_auth("anybody", read_token(root + "/obi/token").c_str());
  EXPECT_EQ(https.Get("/api/v1/jobs")->status, 200);
  EXPECT_THAT(https.Get("/api/v1/session")->body, HasSubstr("\"may_act\":false"));
  EXPECT_EQ(pause(), 403);
  EXPECT_EQ(farm.job(job).state, JobState::kQueued);
  https.set_basic_auth("anybody", read_token(root + "/ann/token").c_str());
  EXPECT_THAT(https.Get("/api/v1/session")->body, HasSubstr("\"may_act\":true"));
  EXPECT_EQ(pause(), 200);
  EXPECT_EQ(farm.job(job).state, JobState::kPaused);
  https.set_basic_auth("anybody", read_token(root + "/gpu/token").c_str());
  EXPECT_EQ(https.Get("/api/v1/jobs")->status, 403);
}

TEST_F(SecureServerTest, TheHttpApiHasTheRolesOfTheRpcs) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  const std::string path = "/v1/jobs/" + job.value;
  httplib::SSLClient https("localhost", server->http_port());
  https.set_ca_cert_path((root + "/ca/ca.crt").c_str());
  const auto get = [&](const std::string& of) { return https.Get(of)->status; };
  const auto pause = [&] { return https.Post(path + ":pause", "{}", "application/json")->status; };
  for (const char* of : {"/v1/jobs", "/v1/openapi.json", "/v1/nothing", "/v1/"})
    EXPECT_EQ(get(of), 401) << of;
  EXPECT_EQ(get(path + "/image"), 401);
  EXPECT_EQ(pause(), 401);
  EXPECT_THAT(https.Get("/v1/jobs")->body, HasSubstr("\"code\":16"));
  https.set_bearer_token_auth("no such token");
  EXPECT_EQ(get("/v1/jobs"), 401);
  https.set_bearer_token_auth(read_token(root + "/obi/token").c_str());
  EXPECT_EQ(get("/v1/jobs"), 200);
  EXPECT_EQ(get("/v1/openapi.json"), 200);
  EXPECT_EQ(get("/v1/nothing"), 404);
  EXPECT_EQ(pause(), 403);
  EXPECT_THAT(https.Post(path + ":pause", "{}", "application/json")->body,
              HasSubstr("this needs submitter or admin"));
  EXPECT_EQ(https.Put("/v1/blobs/ab?size=1", "x", "application/octet-stream")->status, 403);
  EXPECT_EQ(https.Post("/v1/scenes:submit", "{}", "application/json")->status, 403);
  EXPECT_EQ(farm.job(job).state, JobState::kQueued);
  https.set_bearer_token_auth(read_token(root + "/gpu/token").c_str());
  EXPECT_EQ(get("/v1/jobs"), 403);
  https.set_bearer_token_auth(read_token(root + "/ann/token").c_str());
  EXPECT_EQ(pause(), 200);
  EXPECT_EQ(farm.job(job).state, JobState::kPaused);
  // A job bears the name of the token, whoever the request says submits it.
  BlobStore::Writer writer = blobs.begin(sha256_hex("scene"), 5);
  writer.write("scene");
  writer.finish();
  v1::SubmitJobRequest request;
  request.set_submitter("eve");
  request.set_bundle_json(bundle_to_json(fake_bundle()));
  request.set_settings_json(settings_to_json(small_settings(64, 64, 4)));
  std::string body;
  ASSERT_TRUE(google::protobuf::util::MessageToJsonString(request, &body).ok());
  const auto made = https.Post("/v1/jobs", body, "application/json");
  ASSERT_EQ(made->status, 200) << made->body;
  EXPECT_EQ(farm.jobs().back().submitter, "ann");
  // A header that no gRPC metadata could hold.
  https.set_bearer_token_auth("\x80\xff");
  EXPECT_EQ(get("/v1/jobs"), 401);
}

TEST_F(SecureServerTest, SubmissionsOverHttpCountForTheToken) {
  Quotas quotas;
  quotas.submissions_per_minute = 6;  // one at once
  server.reset();
  server = std::make_unique<Server>(
      ServerOptions{.listen = "127.0.0.1:0",
                    .http = "127.0.0.1:0",
                    .security = resolve({.folder = root + "/coordinator"}, Side::kServer),
                    .quotas = quotas},
      farm, blobs);
  httplib::SSLClient https("localhost", server->http_port());
  https.set_ca_cert_path((root + "/ca/ca.crt").c_str());
  https.set_bearer_token_auth(read_token(root + "/ann/token").c_str());
  EXPECT_EQ(https.Post("/v1/jobs", "{}", "application/json")->status, 400) << "it is no job, and counts";
  const auto again = https.Post("/v1/jobs", "{}", "application/json");
  EXPECT_EQ(again->status, 429);
  EXPECT_THAT(again->body, HasSubstr("--submit-rate"));
  EXPECT_EQ(https.Post("/v1/scenes:submit", "{}", "application/json")->status, 429);
  EXPECT_EQ(https.Get("/v1/jobs")->status, 200);
}

}  // namespace
}  // namespace lightmill
