#include "common/rpc/sequence_messages.h"

#include "common/base/error.h"
#include "common/base/utf8.h"
#include "common/rpc/convert.h"

namespace lightmill {
namespace {

using Count = int64_t (v1::FrameCounts::*)() const;
using SetCount = void (v1::FrameCounts::*)(int64_t);

struct StateCount {
  JobState state;
  Count get;
  SetCount set;
};
constexpr StateCount kCounts[] = {
    {JobState::kQueued, &v1::FrameCounts::queued, &v1::FrameCounts::set_queued},
    {JobState::kRunning, &v1::FrameCounts::running, &v1::FrameCounts::set_running},
    {JobState::kPaused, &v1::FrameCounts::paused, &v1::FrameCounts::set_paused},
    {JobState::kDone, &v1::FrameCounts::done, &v1::FrameCounts::set_done},
    {JobState::kFailed, &v1::FrameCounts::failed, &v1::FrameCounts::set_failed},
    {JobState::kCancelled, &v1::FrameCounts::cancelled, &v1::FrameCounts::set_cancelled},
};

}  // namespace

v1::FrameOrder to_proto(FrameOrder order) {
  return order == FrameOrder::kCoarseFirst ? v1::FRAME_ORDER_COARSE_FIRST : v1::FRAME_ORDER_SEQUENTIAL;
}

FrameOrder from_proto(v1::FrameOrder order) {
  switch (order) {
    case v1::FRAME_ORDER_UNSPECIFIED:
    case v1::FRAME_ORDER_SEQUENTIAL:
      return FrameOrder::kSequential;
    case v1::FRAME_ORDER_COARSE_FIRST:
      return FrameOrder::kCoarseFirst;
    default:
      throw Error(ErrorKind::kUsage, "order: this version does not know it");
  }
}

v1::SequenceStatus to_proto(const SequenceStatus& s) {
  v1::SequenceStatus m;
  m.set_id(s.id.value);
  m.set_name(valid_utf8(s.request.name));
  m.set_state(to_proto(s.state));
  m.set_message(valid_utf8(s.message));
  m.set_priority(s.request.priority);
  m.set_pool(valid_utf8(s.request.pool));
  m.set_submitter(valid_utf8(s.request.submitter));
  m.set_max_workers(s.request.max_workers);
  m.set_deadline(s.request.deadline);
  for (const JobId& id : s.request.after) m.add_after(id.value);
  m.set_order(to_proto(s.request.order));
  m.set_fps(s.request.fps);
  m.set_budget_seconds(s.request.budget_seconds);
  m.set_frame_count(s.frame_count);
  for (const StateCount& c : kCounts) (m.mutable_frames()->*c.set)(s.frames[static_cast<int>(c.state)]);
  m.set_first_frame(s.first_frame);
  m.set_last_frame(s.last_frame);
  m.set_packets_done(s.packets_done);
  m.set_packets_total(s.packets_total);
  m.set_wall_seconds(s.wall_seconds);
  m.set_cpu_seconds(s.cpu_seconds);
  m.set_samples_per_second(s.samples_per_second);
  m.set_eta_seconds(s.eta_seconds);
  if (s.relmse_mean) m.set_relmse_mean(*s.relmse_mean);
  if (s.relmse_max) m.set_relmse_max(*s.relmse_max);
  m.set_workers(s.workers);
  m.set_version(s.version);
  return m;
}

SequenceStatus from_proto(const v1::SequenceStatus& m) {
  SequenceStatus s;
  s.id = SequenceId{m.id()};
  s.request.name = m.name();
  s.state = from_proto(m.state());
  s.message = m.message();
  s.request.priority = m.priority();
  s.request.pool = m.pool();
  s.request.submitter = m.submitter();
  s.request.max_workers = m.max_workers();
  s.request.deadline = m.deadline();
  for (const std::string& id : m.after()) s.request.after.push_back(JobId{id});
  s.request.order = from_proto(m.order());
  s.request.fps = m.fps();
  s.request.budget_seconds = m.budget_seconds();
  s.frame_count = m.frame_count();
  for (const StateCount& c : kCounts) s.frames[static_cast<int>(c.state)] = (m.frames().*c.get)();
  s.first_frame = m.first_frame();
  s.last_frame = m.last_frame();
  s.packets_done = m.packets_done();
  s.packets_total = m.packets_total();
  s.wall_seconds = m.wall_seconds();
  s.cpu_seconds = m.cpu_seconds();
  s.samples_per_second = m.samples_per_second();
  s.eta_seconds = m.eta_seconds();
  if (m.has_relmse_mean()) s.relmse_mean = m.relmse_mean();
  if (m.has_relmse_max()) s.relmse_max = m.relmse_max();
  s.workers = m.workers();
  s.version = m.version();
  return s;
}

v1::FrameStatus to_proto(const FrameStatus& s) {
  v1::FrameStatus m;
  m.set_number(s.number);
  m.set_job_id(s.job.value);
  m.set_state(to_proto(s.state));
  m.set_message(valid_utf8(s.message));
  m.set_bundle_digest(s.bundle_digest);
  m.set_spp(s.spp);
  m.set_packets_done(s.packets_done);
  m.set_packets_total(s.packets_total);
  m.set_wall_seconds(s.wall_seconds);
  m.set_cpu_seconds(s.cpu_seconds);
  if (s.relmse) m.set_relmse(*s.relmse);
  if (s.relmse_low) m.set_relmse_low(*s.relmse_low);
  if (s.relmse_high) m.set_relmse_high(*s.relmse_high);
  m.set_version(s.version);
  return m;
}

FrameStatus from_proto(const v1::FrameStatus& m) {
  FrameStatus s;
  s.number = m.number();
  s.job = JobId{m.job_id()};
  s.state = from_proto(m.state());
  s.message = m.message();
  s.bundle_digest = m.bundle_digest();
  s.spp = m.spp();
  s.packets_done = m.packets_done();
  s.packets_total = m.packets_total();
  s.wall_seconds = m.wall_seconds();
  s.cpu_seconds = m.cpu_seconds();
  if (m.has_relmse()) s.relmse = m.relmse();
  if (m.has_relmse_low()) s.relmse_low = m.relmse_low();
  if (m.has_relmse_high()) s.relmse_high = m.relmse_high();
  s.version = m.version();
  return s;
}

}  // namespace lightmill
