"""The options of a command for the keys of a scenario: names, types and choices follow from the scenario."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from loopgate.simulation.scenario import kinds, option_name

HELP = {
    "Loops": {
        "routes": "Route file or .sumocfg with closed loops.",
        "loops": "Number of random loops, if there is no --routes.",
        "loop_length_m": "Length of random loops [m].",
        "max_shared": "Largest share of a random loop in zones with other loops, 0 to 1.",
        "u_turns": "Let vehicles on random loops turn round at junctions.",
        "loops_seed": "Seed of the random loops.",
    },
    "Vehicles": {
        "vehicles": "Number of vehicles. Default: one per loop.",
        "vehicles_per_km": "Number of vehicles per kilometre of loop, in place of --vehicles.",
        "on_loops": "Number of vehicles on each loop, in place of --vehicles: loop0=3,loop4=1.",
        "types": "Vehicle types and their shares: bus=1,car=4. Types of the route file, or SUMO's classes.",
        "drivers": "human (default): as the vehicle types say; machine: no dawdling, short headway.",
        "starts": "Start positions: random (default), or even (more vehicles on longer laps, evenly spaced).",
        "stops": "Additional files with the stops that route files name: FILE,FILE.",
        "traffic": "Route file or .sumocfg with ordinary vehicles, which keep SUMO's rules.",
    },
    "Gate": {
        "gate": "Gate: name or name:option=value. Under 'open' SUMO's right of way rules.",
        "who": (
            "Vehicles under the gate, if trips are read: all (default), loops, a vType, or a file of names."
        ),
        "abstraction": "Cut roads into queues (places) or segments (the paper).",
        "negotiation": (
            "Order of requests: oldest (default on segments), pressure (default on queues), random."
        ),
        "decide": (
            "Who decides slots and the chain rule: central (default), "
            "vehicles:range=150,loss=0.1,delay=0.2, or processes (of the same options): one for each "
            "vehicle."
        ),
        "serve_after_s": "Serve a vehicle that has waited this long for a grant [s]; 0: never.",
        "lights": (
            "Traffic lights: off (default with a gate), keep (default for open), obey (grants into green)."
        ),
        "spacing": "Even spacing on loops: none, hold (at gates; default with --revisit), advice (speeds).",
        "incidents": "TOML file of closures and breakdowns.",
        "standing": ("If a vehicle stands long: contain (default) leads loops round it; wait does not."),
        "rho_m": "Safe radius of the segments abstraction [m].",
        "piece_m": "Longest private piece of the segments abstraction [m].",
    },
    "Watching": {
        "revisit_s": "Name the streets that went unseen for longer than this [s].",
        "weights": "File of streets to visit more often: lines EDGE WEIGHT (with --revisit).",
        "districts": "XML file of polygons: the run says how well each district was watched.",
        "on_deadlock": "Stop the run at a deadlock, or continue.",
        "deadlock_after_s": "Time that vehicles stand in a circle before it counts as a deadlock [s].",
        "starving_s": "Name vehicles that get no grant for this long while others do [s].",
    },
    "Output": {
        "positions": (
            "Record the position of every vehicle at every step; the audit then checks crossings and bodies."
        ),
        "fcd": "SUMO writes fcd.xml.gz into the run folder.",
        "tripinfo": "SUMO writes tripinfo.xml into the run folder.",
        "edgedata": "SUMO writes edgedata.xml into the run folder.",
    },
    "SUMO": {
        "duration_s": "Measured simulated time [s].",
        "warmup_s": "Simulated time before the measured time [s].",
        "seed": "Seed of SUMO, start positions and negotiation.",
        "step_s": "Simulation step [s].",
        "sumo": "More options for SUMO: '--lanechange-output lc.xml ...'.",
    },
}
"""What the options say of themselves, by heading and key, each in the order of use."""

_METAVAR = {"loop_length_m": "MIN:MAX", "decide": "WHO", "sumo": "OPTIONS"}

Command = Callable[..., Any]


def scenario_options(command: Command) -> Command:
    """Give a command an option for each key of a scenario; options that the user leaves out are None."""
    of_keys = kinds()
    for field, words in [pair for group in HELP.values() for pair in group.items()]:
        kind, rule = of_keys[field]
        more: dict[str, Any] = {"type": kind if kind in (int, float) else str, "metavar": _METAVAR.get(field)}
        if rule.words:
            more["type"] = click.Choice(rule.words)
        elif kind is bool:
            more = {"is_flag": True, "default": None}
        command = click.option(f"--{option_name(field)}", field, help=words, **more)(command)
    return command
