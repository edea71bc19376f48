"""What goes wrong in a run, and when: a list of faults drawn from the run's seed alone."""
import dataclasses
import random

HORIZON_S = 3.0  # faults begin within it


@dataclasses.dataclass
class Fault:
    at: float        # seconds after the job began
    kind: str
    target: int      # a worker's number; -1: the coordinator
    seconds: float   # how long it lasts, or until what was ended is started again
    amount: int = 0  # of what the kind says

    def __str__(self):
        who = "coordinator" if self.target < 0 else f"worker{self.target}"
        amount = f"={self.amount}" if self.amount else ""
        return f"{self.at:.2f}s {self.kind}{amount} {who} {self.seconds:.2f}s"


#        kind, of a worker, longest seconds, amounts
KINDS = [("kill", True, 1.0, None), ("stop", True, 2.5, None), ("drain", True, 0.5, None),
         ("kill", False, 1.0, None), ("stop", False, 2.0, None), ("drain", False, 0.5, None),
         ("cut", False, 0.5, (1, 200)), ("cut", False, 0.5, (1, 40)), ("power", False, 0.5, (1, 200)),
         ("power", False, 0.5, (1, 40)),
         ("full", False, 2.5, (1, 3)), ("eio", False, 2.0, (1, 20)), ("readonly", False, 2.0, None),
         ("slow-disk", False, 2.0, (1, 50)),
         ("latency", True, 3.0, (20, 200)), ("rate", True, 3.0, (20, 125)), ("partition", True, 2.5, None),
         ("no-up", True, 2.5, None), ("no-down", True, 2.5, None), ("flapping", True, 2.5, (2, 6)),
         ("reset", True, 0.0, None), ("flip", True, 2.0, (300, 20000)), ("truncate", True, 2.0, (2, 20)),
         ("loss", False, 2.5, (5, 20)), ("line", False, 2.5, (1, 4))]
NEEDS_NAMESPACE = {"loss", "line"}


def draw(seed, workers, namespace, wanted=None):
    """Three to eight faults, in the order of their time. Those that need a network namespace only with one."""
    coin = random.Random(seed)
    faults = []
    kinds = [kind for kind in KINDS if not wanted or kind[0] in wanted]
    for _ in range(coin.randint(3, 8)):
        kind, of_worker, longest, amounts = coin.choice(kinds)
        fault = Fault(round(coin.uniform(0, HORIZON_S), 2), kind, coin.randrange(workers) if of_worker else -1,
                      round(coin.uniform(0.05, 1) * longest, 2), coin.randint(*amounts) if amounts else 0)
        if namespace or kind not in NEEDS_NAMESPACE:
            faults.append(fault)
    return sorted(faults, key=lambda fault: fault.at)
