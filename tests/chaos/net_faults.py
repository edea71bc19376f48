"""A bad line between a worker and the coordinator: a TCP proxy whose faults are switched while it runs."""
import asyncio
import random
import threading
import time


class Link:
    """One proxied address. Plain attributes are its faults; they may be set from any thread at any time."""

    def __init__(self, target_port, seed):
        self.target_port = target_port
        self.port = None
        self.random = random.Random(seed)
        self.flipped = self.truncated = 0
        self.connections = set()
        self.heal()

    def heal(self):
        self.latency = 0.0         # seconds, each way
        self.rate = None           # bytes per second, each way; None: no limit
        self.hold = {"up": False, "down": False}  # True: nothing arrives that way, as in a one-way partition
        self.refuse = False        # no new connections
        self.flip_one_in = 0       # one bit in about so many bytes; 0: none
        self.truncate_one_in = 0   # the connection is cut in the middle of about one piece in so many

    def damage(self, data):
        if not self.flip_one_in or self.random.random() * self.flip_one_in > len(data):
            return data
        self.flipped += 1
        damaged = bytearray(data)
        damaged[self.random.randrange(len(damaged))] ^= 1 << self.random.randrange(8)
        return bytes(damaged)


class Network:
    """Runs the proxies on a thread of their own."""

    def __init__(self):
        self.loop = asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()

    def close(self):
        async def stop():
            for task in asyncio.all_tasks():
                if task is not asyncio.current_task():
                    task.cancel()
            await asyncio.sleep(0)
        asyncio.run_coroutine_threadsafe(stop(), self.loop).result(10)
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join(10)

    def add(self, target_port, seed):
        link = Link(target_port, seed)

        async def serve():
            server = await asyncio.start_server(lambda r, w: self._connection(link, r, w), "127.0.0.1", 0)
            link.server = server
            link.port = server.sockets[0].getsockname()[1]
        asyncio.run_coroutine_threadsafe(serve(), self.loop).result(10)
        return link

    def remove(self, link):
        self.loop.call_soon_threadsafe(link.server.close)
        self.reset(link)

    def reset(self, link):
        """Every connection of the link breaks, without a goodbye."""
        def abort():
            for writer in list(link.connections):
                writer.transport.abort()
        self.loop.call_soon_threadsafe(abort)

    async def _connection(self, link, reader, writer):
        far_writer = None
        link.connections.add(writer)
        try:
            if link.refuse:
                return
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", link.target_port)
            link.connections.add(far_writer)
            ways = [asyncio.ensure_future(self._pump(link, "up", reader, far_writer)),
                    asyncio.ensure_future(self._pump(link, "down", far_reader, writer))]
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            for way in ways:
                way.cancel()
            await asyncio.gather(*ways, return_exceptions=True)
        except OSError:
            pass  # nobody listens there now
        finally:
            for end in (writer, far_writer):
                if end:
                    link.connections.discard(end)
                    end.transport.abort()

    async def _pump(self, link, way, reader, writer):
        queue = asyncio.Queue(64)

        async def deliver():
            while True:
                due, data = await queue.get()
                await asyncio.sleep(max(0.0, due - time.monotonic()))
                while link.hold[way]:
                    await asyncio.sleep(0.02)
                writer.write(data)
                await writer.drain()
        delivery = asyncio.ensure_future(deliver())
        try:
            while True:
                data = await reader.read(16384)
                if not data or delivery.done():
                    return
                if link.rate:
                    await asyncio.sleep(len(data) / link.rate)
                if link.truncate_one_in and link.random.random() * link.truncate_one_in < 1:
                    link.truncated += 1
                    writer.write(data[:len(data) // 2])
                    return
                await queue.put((time.monotonic() + link.latency, link.damage(data)))
        except OSError:
            return
        finally:
            delivery.cancel()
