"""HTTP/2 by hand, for what gRPC's own clients never do: more calls on a connection than the server allows.
"""
import socket
import ssl
import struct
import threading
import time

from hostile_target import GENEROUS_S, PB, code_of
import grpc

# That a connection may have (common/rpc/channel.h); twice as many where the server's settings were never acknowledged.
STREAMS = 100
DATA, HEADERS, RST_STREAM, SETTINGS = 0, 1, 3, 4
END_STREAM, END_HEADERS, ACK = 1, 4, 1


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes((kind, flags)) + struct.pack(">I", stream) + payload


def literal(text):
    text = text.encode()
    assert len(text) < 127 + 128, "one or two bytes of length"
    return (bytes([len(text)]) if len(text) < 127 else bytes([127, len(text) - 127])) + text


class RudeConnection:
    """Sends whatever it is told to, whatever the server's settings say."""

    def __init__(self, target, token, acknowledges):
        folder = target.credentials / "client"
        context = ssl.create_default_context(cafile=str(folder / "ca.crt"))
        context.load_cert_chain(folder / "tls.crt", folder / "tls.key")
        context.set_alpn_protocols(["h2"])
        plain = socket.create_connection(("127.0.0.1", target.rpc), timeout=GENEROUS_S)
        self.socket = context.wrap_socket(plain, server_hostname="localhost")
        self.token, self.acknowledges = token, acknowledges
        self.buffer, self.closed, self.next_stream = b"", False, 1
        self.served, self.refused = set(), set()  # streams that got a message; that were ended
        self.send(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(SETTINGS, 0, 0))

    def send(self, data):
        try:
            self.socket.sendall(data)
        except OSError:
            self.closed = True

    def call(self, path, message):
        """Begins a call and leaves it open."""
        fields = [(":method", "POST"), (":scheme", "https"), (":path", path), (":authority", "localhost"),
                  ("te", "trailers"), ("content-type", "application/grpc"), ("authorization", "Bearer " + self.token)]
        block = b"".join(b"\0" + literal(name) + literal(value) for name, value in fields)
        body = b"\0" + struct.pack(">I", len(message)) + message
        self.send(frame(HEADERS, END_HEADERS, self.next_stream, block) +
                  frame(DATA, END_STREAM, self.next_stream, body))
        self.next_stream += 2

    def answered(self):
        return len(self.served | self.refused)

    def listen(self, seconds):
        """Reads what comes within so much time."""
        end = time.monotonic() + seconds
        while not self.closed and (left := end - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                data = self.socket.recv(65536)
            except TimeoutError:
                return
            except OSError:
                data = b""
            if not data:
                self.closed = True
                return
            self.buffer += data
            while len(self.buffer) >= 9:
                size = int.from_bytes(self.buffer[:3], "big")
                if len(self.buffer) < 9 + size:
                    break
                kind, flags, stream = self.buffer[3], self.buffer[4], int.from_bytes(self.buffer[5:9], "big")
                self.buffer = self.buffer[9 + size:]
                if kind == SETTINGS and not flags & ACK and self.acknowledges:
                    self.send(frame(SETTINGS, ACK, 0))
                elif kind == DATA:
                    self.served.add(stream)
                elif kind == RST_STREAM or kind == HEADERS and flags & END_STREAM:
                    self.refused.add(stream)


def wait(what, condition):
    end = time.monotonic() + GENEROUS_S
    while not condition():
        assert time.monotonic() < end, f"still waiting for: {what}"
        time.sleep(0.05)


def check_streams(target):
    """However many calls a connection begins, so many are served at once."""
    pb = PB["client_pb2"]
    job = target.job()[0]
    ask = pb.WatchJobRequest(job_id=job)

    polite, answered = target.client(), set()
    calls = [polite.WatchJob(ask) for _ in range(STREAMS + 50)]
    for number, call in enumerate(calls):
        def read(number=number, call=call):
            try:
                next(call)
                answered.add(number)
            except grpc.RpcError:
                pass  # cancelled below
        threading.Thread(target=read, daemon=True).start()
    wait("as many as may be", lambda: len(answered) >= STREAMS)
    assert code_of(lambda: target.client().GetJob(pb.GetJobRequest(job_id=job))) == grpc.StatusCode.OK, "others go on"
    assert len(answered) == STREAMS, f"{len(answered)} calls at once"
    for number in list(answered)[:50]:
        calls[number].cancel()
    wait("the rest, in its turn", lambda: len(answered) == STREAMS + 50)
    for call in calls:
        call.cancel()

    for acknowledges in (True, False):
        rude = RudeConnection(target, target.token("client"), acknowledges)
        rude.listen(1)
        for _ in range(4 * STREAMS):
            rude.call("/lightmill.v1.ClientService/WatchJob", ask.SerializeToString())
        wait("an answer to all", lambda: rude.listen(1) or rude.closed or rude.answered() >= 4 * STREAMS)
        most = STREAMS if acknowledges else 2 * STREAMS
        assert len(rude.served) <= most, f"{len(rude.served)} calls at once"
        assert target.process.poll() is None
        rude.socket.close()
