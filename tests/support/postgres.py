"""A PostgreSQL of a test's own: in a temporary folder, reached by a socket in it, so that no port is taken.

    with PostgresServer() as server: ... server.url() ... server.kill() ... server.start()

    postgres.py              prints the URL of one and keeps it until its input ends; 77: there is none to be had
"""
import os
import pathlib
import pwd
import shutil
import signal
import subprocess
import sys
import tempfile
import time

PATIENCE_S = 120


class Missing(Exception):
    """Says what to install."""


def programs():
    """The folder of initdb and postgres: Debian keeps them out of the path."""
    for folder in sorted(pathlib.Path("/usr/lib/postgresql").glob("*/bin"), reverse=True):
        if (folder / "initdb").exists() and (folder / "postgres").exists():
            return folder
    if found := shutil.which("initdb"):
        return pathlib.Path(found).parent
    raise Missing("no PostgreSQL server here; install postgresql")


class PostgresServer:
    def __init__(self):
        self.bin = programs()
        self.process = None
        # It refuses to run as root.
        self.user = pwd.getpwnam("nobody") if os.geteuid() == 0 else pwd.getpwuid(os.geteuid())
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="lightmill-pg-"))
        if os.geteuid() == 0:
            os.chown(self.folder, self.user.pw_uid, self.user.pw_gid)
        self.log = self.folder / "log"
        try:
            self._run("initdb", "--pgdata", self.folder / "data", "--username", "farm", "--auth", "trust",
                      "--encoding", "UTF8", "--locale", "C", "--no-sync").check_returncode()
            self.start()
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _options(self):
        as_user = {} if os.geteuid() != 0 else {"user": self.user.pw_uid, "group": self.user.pw_gid,
                                                "extra_groups": []}
        return {"cwd": self.folder, "env": {"PATH": os.environ["PATH"], "LC_ALL": "C"}, **as_user}

    def _run(self, program, *arguments):
        return subprocess.run([self.bin / program, *map(str, arguments)], stdout=subprocess.DEVNULL,
                              **self._options())

    def start(self):
        """Comes back once it takes connections. What was killed recovers first."""
        with open(self.log, "ab") as log:
            # Killing processes, not machines, is what tests do: the system has all that was written.
            self.process = subprocess.Popen(
                [self.bin / "postgres", "-D", self.folder / "data", "-k", self.folder, "-c", "listen_addresses=",
                 "-c", "fsync=off", "-c", "shared_buffers=16MB", "-c", "max_connections=20"],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log, **self._options())
        end = time.monotonic() + PATIENCE_S
        while subprocess.run([self.bin / "pg_isready", "-q", "-h", self.folder]).returncode != 0:
            assert self.process.poll() is None, f"PostgreSQL ended:\n{self.log.read_text()[-2000:]}"
            assert time.monotonic() < end, "PostgreSQL does not start"
            time.sleep(0.05)

    def url(self, schema=None):
        options = f"&options=-csearch_path%3D{schema}" if schema else ""
        return f"postgresql://farm@/postgres?host={self.folder}{options}"

    def sql(self, text):
        """Runs statements and returns the last result, a string."""
        return subprocess.run([self.bin / "psql", "-qAtX", "-v", "ON_ERROR_STOP=1", self.url(), "-c", text], check=True,
                              capture_output=True, text=True).stdout.strip()

    def stop(self, how):
        """SIGINT: disconnects everybody and ends well. SIGQUIT: ends at once, as a crash of it would."""
        if self.process and self.process.poll() is None:
            self.process.send_signal(how)
            self.process.wait()

    def kill(self):
        """A crash: what transactions did not wait for may be lost."""
        self.stop(signal.SIGQUIT)

    def close(self):
        self.stop(signal.SIGQUIT)
        shutil.rmtree(self.folder, ignore_errors=True)


if __name__ == "__main__":
    try:
        with PostgresServer() as server:
            print(server.url(), flush=True)
            sys.stdin.read()
    except Missing as missing:
        print(missing, file=sys.stderr)
        sys.exit(77)
