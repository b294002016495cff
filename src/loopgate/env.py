"""A scenario as an environment of PettingZoo: agents order the requests, the gate keeps them safe.

Each vehicle is an agent. Its action is a number from 0 to 1: who has the greatest is asked first. So what is
learned is a negotiation, and nothing that is learned can make vehicles collide or lock up: a request that
the gate refuses is refused, whoever comes first.
"""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from math import isfinite, nan
from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from loopgate.control.places import Place, Vehicle
from loopgate.errors import ScenarioError
from loopgate.folders import temporary_folder
from loopgate.model import System
from loopgate.negotiation.base import Request, View
from loopgate.reading import at_least, of_kind, shown
from loopgate.simulation.assembly import assemble
from loopgate.simulation.run import open_session
from loopgate.simulation.run_folder import Folder
from loopgate.simulation.scenario import Scenario
from loopgate.simulation.session import Session

Observation = NDArray[np.float32]

OBSERVED = ("speed", "lap", "to_line", "asks", "waited", "here", "ahead")
"""An agent's observations, each from 0 to 1: its speed as a share of its top speed; how much of its lap it
has driven; how far the end of its last grant is, in units of 100 m; whether it has a request; for how long,
in units of a minute; how full the state is in which that ends, and the one that it wants."""

_NEAR_M, _LONG_S = 100.0, 60.0


class _Priorities:
    """The negotiation: the vehicle with the greatest number goes first, then the oldest request."""

    def __init__(self) -> None:
        self.of: Mapping[str, float] = {}
        """The numbers, by vehicle."""
        self._names: Sequence[str] = ()

    def prepare(self, system: System) -> None:
        """Read the names of the vehicles."""
        self._names = [str(robot.id) for robot in system.robots]

    def order(self, requests: Sequence[Request], view: View, now_s: float) -> Sequence[Request]:
        """Return all requests in order."""
        del view, now_s
        return sorted(requests, key=lambda r: (-self.of.get(self._names[r.robot], 0.0), r.since_s, r.robot))


class LoopgateEnv(ParallelEnv[str, Observation, NDArray[np.float32]]):  # type: ignore[misc]  # no stubs
    """A parallel environment of PettingZoo in which agents set the priorities of vehicles.

    Raises `LoopgateError` if the scenario does not fit together, or has no gate.

    Parameters
    ----------
    scenario
        The run, under a gate; its negotiation is the agents'. An episode lasts for its warm-up and its
        duration. The first one has its seed, each later one the next, unless `reset` is told another.
    every_s
        Time between two actions [s].
    backend
        ``libsumo``, of which there is one simulation at a time in a process, or ``traci``.
    """

    metadata: ClassVar[dict[str, Any]] = {"name": "loopgate_v0", "render_modes": []}

    def __init__(self, scenario: Scenario, *, every_s: float = 5.0, backend: str = "libsumo") -> None:
        scenario = of_kind(Scenario, scenario, "LoopgateEnv: scenario", ScenarioError, "a Scenario")
        if not scenario.gated:
            msg = "gate open: there are no requests to order; name a gate"
            raise ScenarioError(msg)
        if scenario.by_messages is not None:
            msg = f"decide {scenario.decide}: vehicles order their requests themselves; take central"
            raise ScenarioError(msg)
        expected = f"at least the step of {scenario.step_s:g} s"
        every_s = at_least(scenario.step_s, every_s, "every_s", ScenarioError, expected)
        self.scenario = scenario
        self._every_s, self._backend = every_s, backend
        self._seed = scenario.seed
        self._stack = ExitStack()
        self._session: Session | None = None
        self._priorities = _Priorities()
        self._end_s = 0.0
        self.render_mode = None
        assembly = assemble(scenario)
        if assembly.departures:
            first = assembly.departures[0]
            msg = (
                f"env: vehicle {first.vehicle} departs at {first.demand.depart_s:g} s; here all agents are "
                f"there from the beginning: let all depart at 0"
            )
            raise ScenarioError(msg)
        self.possible_agents = [start.vehicle for start in assembly.starts]
        self.agents: list[str] = []
        self.observation_spaces = {
            agent: Box(0.0, 1.0, (len(OBSERVED),), np.float32) for agent in self.possible_agents
        }
        self.action_spaces = {agent: Box(0.0, 1.0, (1,), np.float32) for agent in self.possible_agents}

    def observation_space(self, agent: str) -> Box:
        """Return the space of observations, described by `OBSERVED`."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """Return the space of actions: a priority from 0 to 1."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Begin an episode; return the observation of each agent, and empty infos."""
        del options
        self.close()
        scenario = replace(self.scenario, seed=self._seed if seed is None else seed)
        self._seed = scenario.seed + 1
        self._priorities = _Priorities()
        folder = Folder(self._stack.enter_context(temporary_folder()) / "run", overwrite=True)
        opened = open_session(
            scenario,
            assemble(scenario),
            self._stack.enter_context(folder),
            backend=self._backend,
            negotiation=self._priorities,
        )
        session = self._session = self._stack.enter_context(opened)
        session.drive.begin()
        self._end_s = session.traffic.now_s + scenario.warmup_s + scenario.duration_s
        self.agents = list(self.possible_agents)
        return self._observations(session), {agent: {} for agent in self.agents}

    def _priority(self, agent: str, action: NDArray[np.float32]) -> float:
        """Return the priority that an action is, or raise `ScenarioError` if it is none."""
        if agent not in self.action_spaces:
            msg = f"actions: {shown(agent)} is no agent; the first is {self.possible_agents[0]}"
            raise ScenarioError(msg)
        try:
            priority = float(np.asarray(action, dtype=float).item())
        except (TypeError, ValueError):
            priority = nan
        if not 0.0 <= priority <= 1.0:
            msg = f"actions: that of {agent} is {shown(action)}; expected a number from 0 to 1"
            raise ScenarioError(msg)
        return priority

    def step(
        self, actions: Mapping[str, NDArray[np.float32]]
    ) -> tuple[
        dict[str, Observation],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Set the priorities, drive for `every_s` seconds, and return observations and rewards.

        Returns
        -------
        tuple
            By agent: what it observes; its reward, which is its mean speed [m/s]; False, since nobody ends;
            whether the time is over; and ``laps`` and ``hold_s`` so far.
        """
        session = self._session
        if session is None or not self.agents:
            msg = "no episode is under way; call reset() first"
            raise ScenarioError(msg)
        drive, traffic = session.drive, session.traffic
        self._priorities.of = {agent: self._priority(agent, number) for agent, number in actions.items()}
        before_m = dict(zip(drive.names(), drive.fronts(), strict=True))
        began_s = traffic.now_s
        until_s = min(self._end_s, began_s + self._every_s)
        while traffic.now_s < until_s:
            drive.step()
            for look in session.each_step:
                look()
        over = traffic.now_s >= self._end_s
        driven_s = traffic.now_s - began_s
        agents = self.agents
        fronts_m = zip(drive.names(), drive.fronts(), strict=True)
        rewards = {agent: (front_m - before_m[agent]) / driven_s for agent, front_m in fronts_m}
        infos: dict[str, dict[str, Any]] = {
            agent: {"laps": record.laps, "hold_s": record.total_hold_s(traffic.now_s)}
            for agent, record in drive.records.items()
        }
        observations = self._observations(session)
        if over:
            self.agents = []
            self.close()
        return observations, rewards, dict.fromkeys(agents, False), dict.fromkeys(agents, over), infos

    @staticmethod
    def _observations(session: Session) -> dict[str, Observation]:
        drive, now_s = session.drive, session.traffic.now_s
        seen = {vehicle.name: _seen(vehicle, now_s) for vehicle in drive.vehicles}
        return {agent: np.clip(np.array(one, dtype=np.float32), 0.0, 1.0) for agent, one in seen.items()}

    def render(self) -> None:
        """Show nothing; use ``loopgate run --gui`` to watch a run."""

    def close(self) -> None:
        """End the simulation; may be called at any time."""
        self._session = None
        self._stack.close()


def _seen(vehicle: Vehicle, now_s: float) -> tuple[float, ...]:
    """Return what an agent observes of its vehicle, in the order of `OBSERVED`; it may be beyond 1."""
    left_m = vehicle.left_m()
    return (
        vehicle.speed / vehicle.make.top,
        vehicle.front_m % vehicle.lap_m / vehicle.lap_m,
        left_m / _NEAR_M if isfinite(left_m) else 1.0,
        float(vehicle.asks),
        (now_s - vehicle.since_s) / _LONG_S if vehicle.asks else 0.0,
        _fullness(vehicle.leg.place),
        _fullness(vehicle.wanted()),
    )


def _fullness(place: Place | None) -> float:
    """Return the share of a place's slots that vehicles hold; 0 behind the end of a way."""
    return len(place.bodies) / place.slots if place else 0.0
