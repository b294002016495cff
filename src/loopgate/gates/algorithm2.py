"""Algorithm 2 of Zhou et al. 2020, central version: every circuit of the move must be live by Theorem 1.

Like the paper's algorithm it is neither safe nor free of blocking. There are systems of five robots in which
it admits a move into an inevitable deadlock, and others in which it stops all robots in a live configuration
(docs/studies/what-is-not-true.md). The gate ``certified`` does neither.
"""

from loopgate.errors import GateError
from loopgate.gates.base import Decision, Reason, refusal
from loopgate.gates.circuit_search import BudgetSpent, CircuitSearch
from loopgate.gates.circuits import describe_circuit
from loopgate.gates.collision import collision_decision
from loopgate.gates.following import Follower
from loopgate.model import Placement, System


class Algorithm2Gate(Follower, follows=True):
    """The gate ``algorithm2``: it admits a move if every circuit that it joins is live by Theorem 1.

    States that hold several robots are read as `loopgate.gates.walks` says: one with room is as good as
    private, a full one is an occupied collision state whose robot is the head of its queue. A move into a
    state that keeps room is then free at once, and otherwise, where all states hold several, the decision is
    one walk along the chain of full states.

    Raises `GateError` if an option is not a whole number from 1 up.

    Parameters
    ----------
    lookahead
        Steps of the one robot in condition (2) of Theorem 1: 1 is the paper, more is its Remark 2. More
        look-ahead calls more circuits live, so it admits more.
    budget
        The most search steps per decision, which bounds its time; beyond, the answer is ``BUDGET``. There can
        be exponentially many circuits (Section 4.2 of the paper).

    Notes
    -----
    Source: Algorithm 1 with ``visit`` and ``check``, Algorithm 2 lines 2 to 10. As the proof of Theorem 2
    needs it, all circuits are judged, not only the first. Before the negotiation `Neg`, which is not the
    gate's.
    """

    def __init__(self, system: System, *, lookahead: int = 1, budget: int = 20_000) -> None:
        super().__init__(system)
        self.check_options(lookahead=lookahead, budget=budget)
        self.lookahead = lookahead
        self._search = CircuitSearch(system, lookahead=lookahead, budget=budget)

    @staticmethod
    def check_options(*, lookahead: int = 1, budget: int = 20_000) -> None:
        """Raise `GateError` if an option is not a whole number from 1 up."""
        options: dict[str, object] = {"lookahead": lookahead, "budget": budget}
        for name, value in options.items():
            if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                msg = f"gate algorithm2: {name} is {value!r}; expected a whole number from 1 up"
                raise GateError(msg)

    def decide(self, configuration: Placement, robot: int) -> Decision:
        """Decide the next move of `robot`. A deadlock's blockers are the other robots of its circuit."""
        first = collision_decision(self._system, configuration, robot)
        if not first.admitted:
            return first
        state = self._system.next_state(configuration, robot)
        if state is None or self._system.private[state]:
            return first
        trial = self._trial(configuration)
        position = self._system.make(trial, robot)
        moved = None if self._system.has_room(trial, state) else trial.frozen()
        self._system.take_back(trial, robot, position)
        if moved is None:
            return first
        try:
            circuit = self._search.find(moved, state)
        except BudgetSpent:
            return refusal(Reason.BUDGET, "circuits not all judged within the budget")
        if circuit is None:
            return first
        # The order of a deadlock is the number of its intermediate states (Lemma 3).
        detail = f"order-{len(circuit.intermediate)} deadlock {describe_circuit(self._system, circuit)}"
        return refusal(Reason.DEADLOCK, detail, blockers=(i for i in circuit.robots if i != robot))
