"""The test's side of disk_faults.cc: what the coordinator's disk does from now on."""
import errno
import mmap
import os
import struct

WORDS = ("calls", "cut_at", "power_seed", "error", "error_one_in", "sync_delay_us", "failed", "struck")
CALLS = ("nothing", "a write of the log", "a sync of the log", "a write of the database", "a sync of the database",
         "a change of a file's size", "a rename", "an unlink", "a write of another file", "a sync of another file")


class Disk:
    def __init__(self, path):
        self.path = path
        path.write_bytes(bytes(8 * len(WORDS)))
        with open(path, "r+b") as file:
            self.map = mmap.mmap(file.fileno(), 8 * len(WORDS))

    def get(self, word):
        return struct.unpack_from("<Q", self.map, 8 * WORDS.index(word))[0]

    def set(self, **words):
        for word, value in words.items():
            struct.pack_into("<Q", self.map, 8 * WORDS.index(word), value)

    def heal(self):
        self.set(cut_at=0, power_seed=0, error=0, error_one_in=0, sync_delay_us=0)

    def cut_after(self, calls, power_seed=0):
        """Kills the coordinator before its so-many-th write from now; with a seed, what it had not synced is lost."""
        self.set(power_seed=power_seed, cut_at=self.get("calls") + calls)

    def fail(self, name, one_in=1):
        self.set(error_one_in=one_in, error=getattr(errno, name))

    def struck(self):
        """What the coordinator was about to do when it was last killed."""
        return CALLS[self.get("struck")]

    def environment(self, folder, library):
        return {"LD_PRELOAD": str(library), "CHAOS_FOLDER": str(folder), "CHAOS_CONTROL": os.fspath(self.path)}
