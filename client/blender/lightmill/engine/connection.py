"""Which farm renders: that of a coordinator, or this machine's own."""
import contextlib
import dataclasses
import threading

from . import local_farm, programs
from .farm_api import api


@dataclasses.dataclass(frozen=True)
class Connection:
    """`coordinator`: http(s)://HOST:PORT, several with commas between; empty: this machine. Empty files: none."""
    coordinator: str = ""
    credentials: str = ""  # a folder of `lightmill-coordinator grant`: ca.crt and token
    ca: str = ""
    token_file: str = ""
    cert: str = ""
    key: str = ""
    program: str = ""
    threads: int = 0  # of this machine; 0: all processors
    reconnect_seconds: float = 60.0

    @property
    def local(self):
        return not self.coordinator

    def warm_up(self):
        """Starts this machine's farm in the background if it renders; what goes wrong is told by `open`."""
        if self.local:
            threading.Thread(target=self._try_to_open, name="lightmill-start", daemon=True).start()

    def _try_to_open(self):
        with contextlib.suppress(*ERRORS):
            self.open()

    def open(self):
        """A Farm. Starts this machine's if need be, which takes a moment. Raises a LightmillError, LocalFarmError,
        MissingProgram."""
        if self.local:
            url = local_farm.running(programs.beside(self.program), self.threads).url
            return api.Farm(url, reconnect_seconds=self.reconnect_seconds)
        return api.Farm(self.coordinator, credentials=self.credentials or None, ca=self.ca or None,
                        token_file=self.token_file or None, cert=self.cert or None, key=self.key or None,
                        reconnect_seconds=self.reconnect_seconds)


ERRORS = (api.LightmillError, local_farm.LocalFarmError, programs.MissingProgram)  # each a line for the user
