#pragma once
// Domain types <-> messages of proto/lightmill/v1. From a message: throws Error(kUsage) naming the field if
// it is out of range or malformed; what goes through is safe to compute with.
#include "common/error/error_curve.h"
#include "common/farm/farm_types.h"
#include "lightmill/v1/client.pb.h"
#include "lightmill/v1/types.pb.h"
#include "lightmill/v1/worker.pb.h"

namespace lightmill {

v1::JobState to_proto(JobState state);
JobState from_proto(v1::JobState state);

v1::JobStatus to_proto(const JobStatus& status);
JobStatus from_proto(const v1::JobStatus& message);

v1::TileSpec to_proto(const TileSpec& tile);
TileSpec from_proto(const v1::TileSpec& message);

v1::TileStatus to_proto(const TileStatus& status);
TileStatus from_proto(const v1::TileStatus& message);

v1::WorkerRegistration to_proto(const WorkerRegistration& registration);
WorkerRegistration from_proto(const v1::WorkerRegistration& message);

v1::WorkerStatus to_proto(const WorkerStatus& status);
WorkerStatus from_proto(const v1::WorkerStatus& message);

v1::LeaseKey to_proto(const LeaseKey& key);
LeaseKey from_proto(const v1::LeaseKey& message);

/// SHA-256 over all fields but the digest: to_proto sets it, whoever receives a lease compares.
std::string grant_digest(v1::LeaseGrant grant);
v1::LeaseGrant to_proto(const LeaseGrant& grant);
LeaseGrant from_proto(const v1::LeaseGrant& message);

v1::FailureKind to_proto(FailureKind kind);
/// kTile for one that this version does not know.
FailureKind from_proto(v1::FailureKind kind);

v1::CommitOutcome to_proto(CommitResult result);
CommitResult from_proto(v1::CommitOutcome outcome);

v1::ErrorCurve to_proto(const ErrorCurve& curve);
ErrorCurve from_proto(const v1::ErrorCurve& message);

}  // namespace lightmill
