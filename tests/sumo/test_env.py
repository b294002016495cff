"""The environment for agents that learn: PettingZoo's own test, and that their order counts and is safe."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from loopgate import LoopgateError, Scenario, run

pytest.importorskip("pettingzoo")

from pettingzoo.test import parallel_api_test

from loopgate.env import OBSERVED, LoopgateEnv

pytestmark = pytest.mark.sumo

ROOT = Path(__file__).parents[2]
GRID = str(ROOT / "networks" / "grid5-priority.net.xml")
SCENARIO = Scenario(network=GRID, loops=10, vehicles=80, duration_s=200.0, seed=3)


@pytest.fixture
def env() -> Iterator[LoopgateEnv]:
    """Make an environment, and end its simulation."""
    made = LoopgateEnv(SCENARIO)
    yield made
    made.close()


def episode(env: LoopgateEnv, first: set[str], seed: int = 3) -> dict[str, float]:
    """Return the metres that each agent drives if some of them always go first."""
    seen, _ = env.reset(seed=seed)
    driven = dict.fromkeys(env.agents, 0.0)
    while env.agents:
        actions = {agent: np.array([float(agent in first)], np.float32) for agent in env.agents}
        seen, rewards, ended, over, infos = env.step(actions)
        assert not any(ended.values())
        assert set(over.values()) == {not env.agents}
        for agent, speed in rewards.items():
            driven[agent] += 5.0 * speed
            assert env.observation_space(agent).contains(seen[agent])
            assert infos[agent]["hold_s"] >= 0
    return driven


def test_pettingzoo_takes_it(env: LoopgateEnv, capsys: pytest.CaptureFixture[str]) -> None:
    """Spaces, keys, agents that end: what its test of parallel environments looks at."""
    parallel_api_test(env, num_cycles=20)
    assert "Passed" in capsys.readouterr().out


def test_the_order_counts(env: LoopgateEnv) -> None:
    """The same forty vehicles drive further when they go first than when the others do; seeds repeat."""
    chosen = set(env.possible_agents[::2])
    favoured = episode(env, chosen)
    behind = episode(env, set(env.possible_agents) - chosen)
    assert sum(favoured[a] for a in chosen) > sum(behind[a] for a in chosen)
    assert episode(env, chosen) == favoured
    assert episode(env, chosen, seed=4) != favoured


def test_no_order_is_unsafe(env: LoopgateEnv) -> None:
    """Whatever agents do, nobody goes where the gate does not let it."""
    rng = np.random.default_rng(1)
    env.reset(seed=1)
    for _ in range(39):
        env.step({agent: rng.random(1, np.float32) for agent in env.agents})
    session = env._session
    assert session is not None
    assert (session.drive.trespasses, session.drive.overruns) == (0, 0)
    assert session.traffic.collisions() == ()


def test_observations_tell_who_asks(env: LoopgateEnv) -> None:
    """Somebody does, for some time, before a state that is partly full."""
    seen, _ = env.reset(seed=1)
    for _ in range(20):
        seen, *_ = env.step({})
    table = dict(zip(OBSERVED, np.array(list(seen.values())).T, strict=True))
    assert 0 < table["asks"].sum() < len(seen)
    assert (table["waited"][table["asks"] == 0] == 0).all()
    assert table["here"].min() > 0
    assert 0 < table["speed"].max() <= 1


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"gate": "open"}, "gate open"),
        ({"decide": "vehicles"}, "decide vehicles: vehicles order their requests themselves; take central"),
        ({"every_s": "a"}, "every_s is 'a'"),
        ({"every_s": 0.5}, "every_s is 0.5"),
        ({"every_s": np.nan}, "nan"),
    ],
)
def test_what_makes_no_sense_is_refused(given: dict[str, Any], text: str) -> None:
    """In one line."""
    every_s = given.pop("every_s", 5.0)
    with pytest.raises(LoopgateError, match=text):
        LoopgateEnv(Scenario(network=GRID, loops=1, **given), every_s=every_s)


@pytest.mark.parametrize("action", [np.nan, 5.0, -1.0, "x", None, np.zeros(2)])
def test_an_action_is_a_priority(env: LoopgateEnv, action: Any) -> None:  # noqa: ANN401  what is none
    """From 0 to 1, of an agent."""
    env.reset(seed=1)
    with pytest.raises(LoopgateError, match=f"that of {env.agents[0]} is .*expected a number from 0 to 1"):
        env.step({env.agents[0]: action})
    with pytest.raises(LoopgateError, match="actions: 'nobody' is no agent"):
        env.step({"nobody": np.zeros(1, np.float32)})


def test_a_step_needs_an_episode(env: LoopgateEnv) -> None:
    """Before the first, and after the end of one."""
    with pytest.raises(LoopgateError, match="reset"):
        env.step({})


def test_an_environment_beside_a_run(env: LoopgateEnv) -> None:
    """Both want libsumo: whatever comes second is refused at its start, and the first goes on."""
    env.reset(seed=1)
    scenario = Scenario(network=GRID, loops=2, gate="open", duration_s=20)
    with pytest.raises(LoopgateError, match="is under way in this one"):
        run(scenario)
    refused = []

    def reset(_now_s: float, _course: object) -> None:
        with pytest.raises(LoopgateError, match="is under way in this one") as error:
            env.reset(seed=1)
        refused.append(error)

    env.step({})
    env.close()
    assert run(scenario, tick=reset).summary["outcome"] == "done"
    assert refused
