#pragma once
// What lightmill-worker(1) says beside the options.

namespace lightmill {

inline constexpr const char* kManualDescription =
    R"(Asks a coordinator for tiles, renders them on all its threads, and hands in what they add to the image.
It only dials out. Workers may come and go at any time: the image does not depend on who rendered what.
.PP
Every option can also be given in the environment, or as \fIname\fR = \fIvalue\fR in the TOML file of
.BR \-\-config .
The command line comes first, then the file, then the environment.
)";

inline constexpr const char* kManualClosing = R"(.SH SIGNALS
.TP
.BR SIGTERM ", " SIGINT
Take no more tiles, finish those at hand within
.BR \-\-drain\-timeout ,
and end. A second one ends it at once; its tiles go to other workers.
.SH FILES
.TP
.I /etc/lightmill/worker.toml
The options of the systemd unit
.IR lightmill\-worker.service .
.TP
.I /var/lib/lightmill\-worker
Its cache of scene files.
.SH EXIT STATUS
0: done. 1: it failed. 2: wrong usage. 3: the coordinator refuses it.
.SH SEE ALSO
.BR lightmill (1),
.BR lightmill\-coordinator (1)
)";

}  // namespace lightmill
