#pragma once
// What lightmill-coordinator(1) says beside the options.

namespace lightmill {

inline constexpr const char* kManualDescription =
    R"(Takes jobs, leases their tiles to workers, and merges what they render into one image, the same bit for bit
whoever rendered what. A commit that was acknowledged survives a crash. Serves a web dashboard and metrics.
.PP
Without a command it serves until it is told to end. Every option can also be given in the environment, or as
\fIname\fR = \fIvalue\fR in the TOML file of
.BR \-\-config .
The command line comes first, then the file, then the environment.
)";

inline constexpr const char* kManualClosing = R"(.SH SIGNALS
.TP
.BR SIGTERM ", " SIGINT
Shut down. Jobs go on when it is started again.
.SH FILES
.TP
.I /etc/lightmill/coordinator.toml
The options of the systemd unit
.IR lightmill\-coordinator.service .
.TP
.I /var/lib/lightmill\-coordinator
Its jobs, scene files and images.
.SH EXIT STATUS
0: done. 1: it failed. 2: wrong usage.
.SH SEE ALSO
.BR lightmill (1),
.BR lightmill\-worker (1)
)";

}  // namespace lightmill
