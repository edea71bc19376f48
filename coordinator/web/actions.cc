#include "coordinator/web/actions.h"

#include "coordinator/web/fields.h"

namespace lightmill {
namespace {

struct StopRules {
  std::optional<int64_t> spp;
  std::optional<double> time_s, target_error;
  explicit StopRules(Fields& fields)
      : spp(fields.integer("spp", 1, kMaxSpp)),
        time_s(fields.number("time_seconds")),
        target_error(fields.number("target_error")) {}
  bool any() const { return spp || time_s || target_error; }
};

JobId resubmit(const WebOptions& web, const JobId& id, Fields& fields, const std::string& user) {
  const JobStatus old = web.farm.job(id);
  const StopRules rules(fields);
  JobRequest request;
  request.settings = old.settings;
  if (rules.any()) {
    request.settings.spp = rules.spp.value_or(kMaxSpp);
    request.settings.time_s = rules.time_s.value_or(0);
    request.settings.target_error = rules.target_error.value_or(0);
  }
  if (const auto seed = fields.integer("seed", 0, INT64_MAX))
    request.settings.seed = static_cast<uint64_t>(*seed);
  // A pilot chose for other settings than these; it looks again.
  if (request.settings.integrator == Integrator::kAuto) request.settings.plan.reset();
  request.name = fields.text("name").value_or(old.name);
  request.pool = fields.text("pool").value_or(old.pool);
  request.priority =
      static_cast<int>(fields.integer("priority", -kMaxPriority, kMaxPriority).value_or(old.priority));
  request.submitter = user.empty() ? old.submitter : user;
  request.max_workers = old.max_workers;
  fields.end();
  request.bundle = web.farm.bundle(old.bundle_digest);
  check_quotas(web.quotas, request);
  for (const BundleEntry& entry : request.bundle.entries) {
    if (!web.blobs.contains(entry.digest))
      throw Error(ErrorKind::kFailed,
                  "file " + entry.name + " of the scene is not on the coordinator any more");
  }
  const std::string refusal = web.submissions ? web.submissions->refusal(user) : "";
  if (!refusal.empty()) throw LimitReached(refusal);
  return web.farm.submit(request);
}

/// What is done to a job and to a sequence alike.
template <class Id>
void change(Farm& farm, const std::string& action, const Id& id, Fields& fields) {
  if (action == "extend") {
    const StopRules rules(fields);
    fields.end();
    if (!rules.any()) throw Error(ErrorKind::kUsage, "give spp, time_seconds or target_error");
    return farm.extend(id, rules.spp, rules.time_s, rules.target_error);
  }
  if (action == "priority") {
    const auto priority = fields.integer("priority", -kMaxPriority, kMaxPriority);
    fields.end();
    if (!priority) throw Error(ErrorKind::kUsage, "give priority");
    return farm.set_priority(id, static_cast<int>(*priority));
  }
  fields.end();
  if (action == "pause") farm.pause(id);
  if (action == "resume") farm.resume(id);
  if (action == "cancel") farm.cancel(id);
  if (action == "retry") farm.retry(id);
}

}  // namespace

const std::vector<std::string>& sequence_action_names() {
  static const std::vector<std::string> names = {"pause", "resume", "cancel", "retry", "extend", "priority"};
  return names;
}

const std::vector<std::string>& action_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all = sequence_action_names();
    all.push_back("resubmit");
    return all;
  }();
  return names;
}

JobId act(const WebOptions& web, const std::string& action, const JobId& job, const std::string& body,
          const std::string& user) {
  Fields fields(body);
  if (action == "resubmit") return resubmit(web, job, fields, user);
  change(web.farm, action, job, fields);
  return job;
}

void act(const WebOptions& web, const std::string& action, const SequenceId& sequence,
         const std::string& body) {
  Fields fields(body);
  change(web.farm, action, sequence, fields);
}

}  // namespace lightmill
