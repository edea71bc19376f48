"""Files named by what is in them, and what is remembered from one export to the next."""
import errno
import hashlib
import os
import tempfile
from pathlib import Path


MOST_BYTES = 64 << 30  # of one file
CHUNK = 1 << 24


def chunks(source):
    return iter(lambda: source.read(CHUNK), b"")


class Cache:
    """What earlier exports have made, by the data that it was made of. Give the same one to every export of a
    session. Entries are (fingerprint of the data, names of files); a file that is gone is made again."""

    MOST = 200_000  # entries

    def __init__(self):
        self._entries = {}
        self.pictures = {}  # of nodes.Context

    def find(self, key, fingerprint, folder):
        """What was made of data with this fingerprint, if all of its files are in `folder`, else None."""
        entry = self._entries.get(key)
        if entry is None or entry[0] != fingerprint:
            return None
        made, names = entry[1:]
        return made if all(folder.has(name) for name in names) else None

    def store(self, key, fingerprint, made, names):
        """`made` may be anything; `names` are the files, relative to the folder, that it needs."""
        if len(self._entries) >= self.MOST:
            self._entries.clear()
        self._entries[key] = (fingerprint, made, tuple(names))


class Folder:
    """A scene's folder. `files`: every file that the scene needs, in order; `written`: how many were new."""

    def __init__(self, path):
        self.path = Path(path)
        self.path.mkdir(parents=True, exist_ok=True)
        self._names = {}  # in order
        self._there = set()
        self.written = 0

    @property
    def files(self):
        return [self.path / name for name in self._names]

    def has(self, name):
        """Whether the file is there; if so the scene needs it."""
        if name not in self._there:
            if not (self.path / name).is_file():
                return False
            self._there.add(name)
        self._names[name] = None
        return True

    def write(self, data, folder, suffix):
        """Bytes, or a list of things like bytes, as `folder/SHA-256.suffix`, whose name is returned. What is
        there already is not written again; a file is there as a whole or not at all."""
        parts = data if isinstance(data, list) else [data]
        digest = hashlib.sha256()
        for part in parts:
            digest.update(part)
        name = f"{folder}/{digest.hexdigest()}.{suffix}"
        if not self.has(name):
            self.replace(name, parts)
            self.has(name)
        return name

    def copy(self, path, folder, suffix, cache):
        """A copy of a file, as `write` names it; not read again while its size and time stay. Raises OSError."""
        status = os.stat(path)
        fingerprint = (status.st_size, status.st_mtime_ns)
        if status.st_size > MOST_BYTES:
            raise OSError(errno.EFBIG, "it is larger than 64 GiB")
        name = cache.find(("file", path), fingerprint, self)
        if name is None:
            digest = hashlib.sha256()
            with open(path, "rb") as source:
                for part in chunks(source):
                    digest.update(part)
                name = f"{folder}/{digest.hexdigest()}.{suffix}"
                if not self.has(name):
                    source.seek(0)
                    self.replace(name, chunks(source))
                    self.has(name)
            cache.store(("file", path), fingerprint, name, [name])
        return name

    def replace(self, name, parts):
        """Writes a file in one step."""
        target = self.path / name
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=target.parent)
        try:
            with os.fdopen(handle, "wb") as out:
                for part in parts:
                    out.write(part)
            os.chmod(temporary, 0o644)
            os.replace(temporary, target)
        except BaseException:
            os.unlink(temporary)
            raise
        self.written += 1
