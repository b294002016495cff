"""Options of a scenario that have no effect on its run: they are named, not passed over."""

from dataclasses import fields
from typing import Final

from loopgate.reading import listed
from loopgate.simulation.scenario import Scenario, option_name

_OF_RANDOM_LOOPS: Final = ("loops", "loop_length_m", "max_shared", "u_turns", "loops_seed")
_OF_SEGMENTS: Final = ("max_shared", "rho_m", "piece_m")
_OF_CLOSED_LOOPS: Final = ("starts", "spacing")


def without_effect(
    scenario: Scenario, end_s: float, *, from_file: bool, closed: bool, once: bool
) -> tuple[str, ...]:
    """Return a warning for each reason for which options that a scenario gives have no effect.

    Parameters
    ----------
    end_s
        When the run ends [s].
    from_file
        Whether loops and trips are read from a file.
    closed, once
        Whether there are vehicles on closed loops, and vehicles that drive once.
    """
    names: dict[str, tuple[str, ...]] = {}
    if from_file:
        names[f"the loops are those of {scenario.routes or scenario.network}"] = _OF_RANDOM_LOOPS
    if scenario.abstraction == "queues":
        names["the roads are cut into queues, not into segments"] = _OF_SEGMENTS
    if not closed:
        names["no vehicle is on a closed loop"] = _OF_CLOSED_LOOPS
    if not once and scenario.rule_for_gated not in {"all", "loops"}:
        names["all vehicles are on closed loops"] = ("who",)
    default = {field.name: field.default for field in fields(Scenario)}
    found, told = [], set[str]()
    for why, those in names.items():
        given = [name for name in those if getattr(scenario, name) != default[name] and name not in told]
        told.update(given)
        if given:
            has = "has" if len(given) == 1 else "have"
            options = listed([f"--{option_name(name)}" for name in given])
            found.append(f"{options} {has} no effect: {why}")
    if said := scenario.by_messages:
        disturbed = {"kill_at": (said.kill, said.kill_at_s), "cut_at": (said.cut_s, said.cut_at_s)}
        found += [
            f"--decide: {what} {at_s:g} has no effect: the run ends at {end_s:g} s"
            for what, (much, at_s) in disturbed.items()
            if much and at_s >= end_s
        ]
    return tuple(found)
