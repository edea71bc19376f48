"""HTTP to the coordinators of a farm: connections that are kept, the one that leads, tokens, TLS, errors.

A standby answers everything with 503, as if it were away, so that each coordinator may be tried in turn. A request that
changes something is sent a second time only if it can't have arrived.
"""
from __future__ import annotations

import contextlib
import copy
import http.client
import json
import os
import pathlib
import socket
import ssl
import threading
import urllib.parse
from collections.abc import Iterator, Mapping
from typing import Any

from .errors import InvalidArgument, LightmillError, ServerError, Unreachable, error_of

DEFAULT_PORT = 7071
ANSWER_SECONDS = 60.0     # a coordinator that is silent for longer is taken for dead
SCENE_SECONDS = 200.0     # it reads scenes for up to two minutes, and others may come first
CONNECT_SECONDS = 10.0
MAX_ERROR_BYTES = 1 << 20
_LOOPBACK = ("localhost", "127.0.0.1", "::1")
_LOST = (OSError, http.client.HTTPException)

Path = str | os.PathLike[str]


class Scope:
    """A call that may be given up from another thread."""

    def __init__(self) -> None:
        self.ended = threading.Event()
        self._lock = threading.Lock()
        self._connections: set[http.client.HTTPConnection] = set()

    def cancel(self) -> None:
        """Ends what is under way with Unreachable, soon."""
        self.ended.set()
        with self._lock:
            for connection in self._connections:
                if connection.sock is not None:
                    with contextlib.suppress(OSError):
                        connection.sock.shutdown(socket.SHUT_RDWR)

    def check(self) -> None:
        if self.ended.is_set():
            raise Unreachable("the call was given up")

    @contextlib.contextmanager
    def holding(self, connection: http.client.HTTPConnection) -> Iterator[None]:
        with self._lock:
            self._connections.add(connection)
        try:
            self.check()
            yield
        finally:
            with self._lock:
                self._connections.discard(connection)


class Address:
    """Where a coordinator's HTTP is."""

    def __init__(self, text: str, secure: bool) -> None:
        url = urllib.parse.urlsplit(text if "//" in text else f"{'https' if secure else 'http'}://{text}")
        try:
            port = url.port
        except ValueError:
            port = -1
        if (url.scheme not in ("http", "https") or not url.hostname or port == -1 or url.path.strip("/")
                or not url.hostname.isprintable() or " " in url.hostname):
            raise InvalidArgument(f"{text!r} is no address of a coordinator; give http(s)://HOST:PORT")
        self.host, self.port, self.tls = url.hostname, port or DEFAULT_PORT, url.scheme == "https"

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'https' if self.tls else 'http'}://{host}:{self.port}"


class Answer:
    """An answer whose body is read as it comes. Close it, or read it to its end."""

    def __init__(self, transport: Transport, address: int, connection: http.client.HTTPConnection,
                 response: http.client.HTTPResponse) -> None:
        self._transport, self._address = transport, address
        self._connection, self._response = connection, response
        self._ended = False  # read to its end: the connection may be another call's
        self.content_type = response.headers.get_content_type()

    def read(self, size: int = -1) -> bytes:
        """So many bytes at most; all without `size`. Raises Unreachable if the connection is lost."""
        try:
            with self._transport.scope.holding(self._connection):
                data = self._response.read() if size < 0 else self._response.read(size)
        except _LOST as error:
            self.close()
            raise Unreachable(f"the connection was lost ({_reason(error)})") from error
        if self._response.isclosed() and not self._ended:
            self._ended = True
            self._transport._keep(self._address, self._connection)
        return data

    def line(self) -> bytes:
        """The next line; empty at the end."""
        try:
            with self._transport.scope.holding(self._connection):
                return self._response.readline()
        except _LOST as error:
            self.close()
            raise Unreachable(f"the connection was lost ({_reason(error)})") from error

    def close(self) -> None:
        if not self._ended:
            self._ended = True
            self._connection.close()


def _reason(error: BaseException) -> str:
    text = str(error).strip().splitlines()
    return text[0] if text else type(error).__name__


class Transport:
    """Thread-safe."""

    def __init__(self, addresses: list[str], *, token: str | None = None, token_file: Path | None = None,
                 ca: Path | None = None, cert: Path | None = None, key: Path | None = None) -> None:
        secure = any(part is not None for part in (token, token_file, ca, cert))
        self.addresses = [Address(text, secure) for text in addresses]
        if not self.addresses:
            raise InvalidArgument("give the address of a coordinator, http(s)://HOST:PORT")
        if token is not None and token_file is not None:
            raise InvalidArgument("give token or token_file, not both")
        if token is not None and (not token.strip() or not token.strip().isascii() or "\n" in token.strip()):
            raise InvalidArgument("the token is not one line of ASCII")
        self._token, self._token_file = token, pathlib.Path(token_file) if token_file is not None else None
        for address in self.addresses:
            if not address.tls and address.host not in _LOOPBACK and (token or token_file):
                raise InvalidArgument(f"a token does not go to {address} in plain text; use https")
        self._tls: ssl.SSLContext | None = None
        if any(address.tls for address in self.addresses):
            try:
                self._tls = ssl.create_default_context(cafile=os.fspath(ca) if ca is not None else None)
                if cert is not None:
                    self._tls.load_cert_chain(os.fspath(cert), os.fspath(key) if key is not None else None)
            except (OSError, ssl.SSLError) as error:
                raise InvalidArgument(f"ca, cert or key can't be used ({_reason(error)})") from error
        self._state = _State()
        self.scope = Scope()

    def scoped(self, scope: Scope) -> Transport:
        """The same connections for calls that `scope` can give up."""
        other = copy.copy(self)
        other.scope = scope
        return other

    def close(self) -> None:
        """Closes the connections that are kept. Later calls make new ones."""
        self._state.close()

    def call(self, method: str, path: str, *, query: Mapping[str, Any] | None = None, body: Any = None,
             data: bytes | None = None, timeout: float = ANSWER_SECONDS) -> Any:
        """A call whose answer is JSON. `body` is made JSON, `data` goes as it is. Raises a LightmillError."""
        content_type = "application/octet-stream"
        if data is None and body is not None:
            data, content_type = json.dumps(body).encode(), "application/json"
        answer = self.open(method, path, query=query, data=data, content_type=content_type, timeout=timeout)
        text = answer.read()
        try:
            return json.loads(text)
        except ValueError as error:
            raise ServerError("the coordinator's answer is no JSON; is it of the same version?") from error

    def open(self, method: str, path: str, *, query: Mapping[str, Any] | None = None, data: bytes | None = None,
             content_type: str = "application/json", timeout: float = ANSWER_SECONDS) -> Answer:
        """Sends a request to the coordinator that leads. Raises the error that it answers, or Unreachable."""
        target = urllib.parse.quote(path, safe="/:")
        if query:
            target += "?" + urllib.parse.urlencode({k: _parameter(v) for k, v in query.items() if v is not None})
        headers = {"Accept": "application/json", **self._authorization()}
        if data is not None:
            headers["Content-Type"] = content_type
        elif method in ("POST", "PUT"):
            headers["Content-Length"] = "0"
        lost: LightmillError | None = None
        first = self._state.leader
        for i in range(len(self.addresses)):
            number = (first + i) % len(self.addresses)
            try:
                answer = self._try(number, method, target, data, headers, timeout)
            except Unreachable as error:
                self.scope.check()
                lost = lost or error
                if isinstance(error, _MayHaveArrived):
                    raise
                continue
            self._state.leader = number
            return answer
        assert lost is not None
        raise lost

    def _try(self, number: int, method: str, target: str, data: bytes | None, headers: dict[str, str],
             timeout: float) -> Answer:
        # A kept connection may have been closed meanwhile; then what was sent may be sent again only if that does no harm.
        again = method in ("GET", "PUT")
        connection = self._state.take(number) if again else None
        while True:
            kept = connection is not None
            if connection is None:
                connection = self._connect(number)
            try:
                with self.scope.holding(connection):
                    assert connection.sock is not None
                    connection.sock.settimeout(timeout)
                    connection.request(method, target, body=data, headers=headers)
                    response = connection.getresponse()
                break
            except _LOST as error:
                connection.close()
                self.scope.check()
                if kept:
                    connection = None
                    continue
                kind = Unreachable if again else _MayHaveArrived
                raise kind(f"{self.addresses[number]}: the connection was lost ({_reason(error)})") from error
        answer = Answer(self, number, connection, response)
        if response.status < 300:
            return answer
        text = answer.read(MAX_ERROR_BYTES)
        answer.close()
        raise self._error(number, response.status, text)

    def _error(self, number: int, status: int, text: bytes) -> LightmillError:
        try:
            error = error_of(json.loads(text))
        except ValueError:  # not ours: a proxy in between, or an older coordinator
            line = text.decode("utf-8", "replace").strip().splitlines()
            said = f"{self.addresses[number]}: HTTP {status}" + (f": {line[0][:300]}" if line else "")
            error = Unreachable(said) if status in (502, 503, 504) else ServerError(said)
        return error

    def _authorization(self) -> dict[str, str]:
        token = self._token
        if self._token_file is not None:
            try:
                token = self._token_file.read_text("utf-8")  # each time: tokens are renewed
            except (OSError, ValueError) as error:
                raise InvalidArgument(f"token_file {self._token_file} can't be read ({_reason(error)})") from error
        return {} if token is None else {"Authorization": f"Bearer {token.strip()}"}

    def _connect(self, number: int) -> http.client.HTTPConnection:
        address = self.addresses[number]
        connection: http.client.HTTPConnection
        if address.tls:
            connection = http.client.HTTPSConnection(address.host, address.port, timeout=CONNECT_SECONDS,
                                                     context=self._tls)
        else:
            connection = http.client.HTTPConnection(address.host, address.port, timeout=CONNECT_SECONDS)
        try:
            connection.connect()
        except ssl.SSLCertVerificationError as error:
            raise Unreachable(f"{address}: its certificate is not trusted ({error.verify_message}); is ca right?"
                              ) from error
        except OSError as error:
            raise Unreachable(f"{address} can't be reached ({_reason(error)}); is it running, and is the address right?"
                              ) from error
        return connection

    def _keep(self, number: int, connection: http.client.HTTPConnection) -> None:
        if connection.sock is not None:
            self._state.give(number, connection)


class _MayHaveArrived(Unreachable):
    """The request was sent, and no answer came: it must not be sent again."""


class _State:
    """What all copies of a transport share."""
    MOST_KEPT = 4

    def __init__(self) -> None:
        self.leader = 0  # the one that answered last
        self._lock = threading.Lock()
        self._kept: list[tuple[int, http.client.HTTPConnection]] = []

    def close(self) -> None:
        with self._lock:
            kept, self._kept = self._kept, []
        for _, connection in kept:
            connection.close()

    __del__ = close

    def take(self, number: int) -> http.client.HTTPConnection | None:
        with self._lock:
            for i, (kept, connection) in enumerate(self._kept):
                if kept == number:
                    del self._kept[i]
                    return connection
        return None

    def give(self, number: int, connection: http.client.HTTPConnection) -> None:
        with self._lock:
            if len(self._kept) < self.MOST_KEPT and all(c is not connection for _, c in self._kept):
                self._kept.append((number, connection))
                return
        connection.close()


def _parameter(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)
