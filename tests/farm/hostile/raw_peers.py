"""Peers that speak HTTP/2 and HTTP by hand, over sockets that never block, and take or send as they like."""
import select
import socket
import struct

HEADERS, SETTINGS, PING = 1, 4, 6
END_HEADERS, ACK, END_STREAM = 4, 1, 1
MAX_FRAME = 16384
INITIAL_WINDOW = 4  # the setting's number


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes((kind, flags)) + struct.pack(">I", stream) + payload


def literal(text):
    text = text.encode()
    return (bytes([len(text)]) if len(text) < 127 else bytes([127, len(text) - 127])) + text


class RawPeer:
    """A connection with something to send; what comes is read only if `reads`."""

    def __init__(self, port, data, reads):
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setblocking(False)
        self.out, self.reads, self.closed = data, reads, False

    def turn(self, most):
        """Sends so many bytes at most, and reads as many."""
        try:
            if self.out and most:
                self.out = self.out[self.socket.send(self.out[:most]):]
            if self.reads and not self.socket.recv(max(most, 1)):
                self.close()
        except BlockingIOError:
            pass
        except OSError:
            self.close()

    def close(self):
        self.closed = True
        self.socket.close()


def http2_call(path, body, size=None, window=65535, end=True, streams=1):
    """Bytes of a connection with calls of a gRPC method. `size`: what each announces, which may be more than it
    sends."""
    fields = [(":method", "POST"), (":scheme", "http"), (":path", "/lightmill.v1." + path), (":authority", "localhost"),
              ("te", "trailers"), ("content-type", "application/grpc")]
    block = b"".join(b"\0" + literal(name) + literal(value) for name, value in fields)
    data = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(SETTINGS, 0, 0, struct.pack(">HI", INITIAL_WINDOW, window))
    data += frame(SETTINGS, ACK, 0)
    message = b"\0" + struct.pack(">I", len(body) if size is None else size) + body
    for stream in range(1, 2 * streams, 2):
        data += frame(HEADERS, END_HEADERS, stream, block)
        for at in range(0, len(message), MAX_FRAME):
            last = end and at + MAX_FRAME >= len(message)
            data += frame(0, END_STREAM if last else 0, stream, message[at:at + MAX_FRAME])
    return data


class Crowd:
    """Many raw peers, of which the closed ones are forgotten."""

    def __init__(self, most):
        self.most, self.peers = most, []

    def add(self, port, data, reads):
        self.peers = [peer for peer in self.peers if not peer.closed]
        while len(self.peers) >= self.most:
            self.peers.pop(0).close()
        try:
            self.peers.append(RawPeer(port, data, reads))
        except OSError:
            pass  # turned away: so be it

    def turn(self, random):
        select.select([], [], [], 0.002)
        for peer in self.peers:
            if not peer.closed:
                peer.turn(random.choice((0, 1, 100, 16384)))

    def close(self):
        for peer in self.peers:
            peer.close()
