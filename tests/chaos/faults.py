"""Carries out a schedule: begins and ends every fault at its time, while supervising the farm."""
import heapq
import itertools
import signal
import subprocess
import time


def _iptables(*rule):
    subprocess.run(["iptables", *rule], check=True, capture_output=True)


class Injector:
    def __init__(self, farm, faults):
        self.farm = farm
        self.order = itertools.count()
        self.agenda = [(fault.at, next(self.order), lambda f=fault: self.begin(f)) for fault in faults]
        heapq.heapify(self.agenda)
        self.start = time.monotonic()
        self.undo = []  # what must be taken back when the run fails half-way

    def now(self):
        return time.monotonic() - self.start

    def later(self, seconds, action):
        heapq.heappush(self.agenda, (self.now() + seconds, next(self.order), action))

    def step(self):
        """Does what is due. False once nothing is left to come."""
        while self.agenda and self.agenda[0][0] <= self.now():
            heapq.heappop(self.agenda)[2]()
        self.farm.supervise()
        return bool(self.agenda)

    def begin(self, fault):
        name = "on_" + fault.kind.replace("-", "_")
        getattr(self, name)(fault)

    # --- processes ---
    def _process(self, fault):
        farm = self.farm
        process = farm.coordinator if fault.target < 0 else farm.workers[fault.target]
        return process if process.poll() is None else None  # a fault on what is down already hits nothing

    def _due(self, fault):
        due = time.monotonic() + fault.seconds
        if fault.target < 0:
            self.farm.coordinator_due = due
        else:
            self.farm.worker_due[fault.target] = due

    def on_kill(self, fault):
        if process := self._process(fault):
            self._due(fault)
            process.kill()
            process.wait()

    def on_drain(self, fault):
        if process := self._process(fault):
            self.farm.expected_dead.add(process.pid)
            process.send_signal(signal.SIGTERM)
            self._due(fault)

    def on_stop(self, fault):
        if process := self._process(fault):
            process.send_signal(signal.SIGSTOP)
            self.later(fault.seconds, lambda: process.poll() is None and process.send_signal(signal.SIGCONT))

    # --- the coordinator's disk ---
    def on_cut(self, fault):
        self.farm.disk.cut_after(fault.amount)

    def on_power(self, fault):
        self.farm.disk.cut_after(fault.amount, power_seed=1 + int(fault.at * 100))

    def _failing(self, fault, error):
        self.farm.disk.fail(error, max(1, fault.amount))
        self.later(fault.seconds, lambda: self.farm.disk.set(error=0))

    def on_full(self, fault):
        self._failing(fault, "ENOSPC")

    def on_eio(self, fault):
        self._failing(fault, "EIO")

    def on_readonly(self, fault):
        self._failing(fault, "EROFS")

    def on_slow_disk(self, fault):
        self.farm.disk.set(sync_delay_us=fault.amount * 1000)
        self.later(fault.seconds, lambda: self.farm.disk.set(sync_delay_us=0))

    # --- a worker's line ---
    def _line(self, fault, **values):
        link = self.farm.links[fault.target]
        for name, value in values.items():
            setattr(link, name, value)
        self.later(fault.seconds, link.heal)

    def on_latency(self, fault):
        self._line(fault, latency=fault.amount / 1000)

    def on_rate(self, fault):
        self._line(fault, rate=fault.amount * 1000)

    def on_partition(self, fault):
        self._line(fault, hold={"up": True, "down": True}, refuse=True)

    def on_no_up(self, fault):
        self._line(fault, hold={"up": True, "down": False})

    def on_no_down(self, fault):
        self._line(fault, hold={"up": False, "down": True})

    def on_flapping(self, fault):
        link = self.farm.links[fault.target]
        for i in range(fault.amount):
            down = i * fault.seconds / fault.amount
            self.later(down, lambda: (setattr(link, "refuse", True), self.farm.network.reset(link)))
            self.later(down + fault.seconds / fault.amount / 2, lambda: setattr(link, "refuse", False))

    def on_reset(self, fault):
        self.farm.network.reset(self.farm.links[fault.target])

    def on_flip(self, fault):
        self._line(fault, flip_one_in=fault.amount)

    def on_truncate(self, fault):
        self._line(fault, truncate_one_in=fault.amount)

    # --- the namespace's own loopback: all lines at once ---
    def on_loss(self, fault):
        port = self.farm.address.rsplit(":", 1)[1]
        for side in ("--dport", "--sport"):
            rule = ["INPUT", "-i", "lo", "-p", "tcp", side, port, "-m", "statistic", "--mode", "random", "--probability",
                    str(fault.amount / 100), "-j", "DROP"]
            _iptables("-A", *rule)
            self.later(fault.seconds, lambda rule=rule: _iptables("-D", *rule))

    def on_line(self, fault):
        subprocess.run(["tc", "qdisc", "replace", "dev", "lo", "root", "tbf", "rate", f"{fault.amount}mbit", "burst",
                        "32kbit", "latency", "400ms"], check=True, capture_output=True)
        self.later(fault.seconds, lambda: subprocess.run(["tc", "qdisc", "del", "dev", "lo", "root"],
                                                         capture_output=True))
