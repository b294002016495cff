"""Check Lemmas 1 to 4 on the circuits that are deadlocks of some order by Definition 11.

    python analysis/lemmas.py --systems 1500

Looks at every configuration of random systems that is neither live nor a deadlock, and there at every circuit
with an order. The paper considers only simple ones (Remark 1): no circuit of fewer of their robots is a
deadlock.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter

import numpy as np

from loopgate.gates.algorithm2 import all_circuits, lemma1
from loopgate.research.state_space import StateSpace
from loopgate.research.theory.orders import Orders
from loopgate.research.theory.random_systems import small_system

LEMMAS = ("lemma1", "lemma2", "lemma3", "lemma4")


def judge(seed: int) -> Counter[str]:
    """Count the circuits of one system, and those that break a lemma, simple or not."""
    system = small_system(seed)
    space = StateSpace(system)
    orders = Orders(system)
    counts: Counter[str] = Counter()
    for number in np.flatnonzero(~space.live & ~space.locked).tolist():
        here = space.configuration(number)
        circuits = [(circuit, orders.of_circuit(here, circuit)) for circuit in all_circuits(system, here)]
        deadlocks = [(set(circuit.robots), circuit, k) for circuit, k in circuits if k is not None]
        for robots, circuit, k in deadlocks:
            if k == 0:
                continue
            simple = not any(fewer < robots for fewer, _, _ in deadlocks)
            kind = "simple" if simple else "others"
            counts[kind] += 1
            most, between = len(circuit.walks) - 3, len(circuit.intermediate)
            fits = between <= most and all(len(set(walk.intermediate)) <= most for walk in circuit.walks)
            holds = (lemma1(system, circuit), k <= most, k == between, fits)
            for name, true in zip(LEMMAS, holds, strict=True):
                counts[f"{kind}_break_{name}"] += not true
    return counts


def main() -> None:
    """Run the study and print its counts."""
    parser = argparse.ArgumentParser(description="Check Lemmas 1 to 4 on random systems.")
    parser.add_argument("--systems", type=int, default=500, help="number of seeds, from --first on")
    parser.add_argument("--first", type=int, default=5000)
    arguments = parser.parse_args()
    total: Counter[str] = Counter()
    for seed in range(arguments.first, arguments.first + arguments.systems):
        total.update(judge(seed))
    print(json.dumps(dict(sorted(total.items())), indent=1))


if __name__ == "__main__":
    main()
