"""Options that a scenario passes on to SUMO's command line."""

import shlex
from collections.abc import Iterator

from loopgate.errors import ScenarioError

OWN_OUTPUT = {
    "output-prefix": "",
    "output-suffix": "",
    "output.format": "xml",
    "human-readable-time": "false",
    "device.tripinfo.probability": "1",
}
"""Options of SUMO's output, with the values by which loopgate can read what SUMO writes for it."""

OUTPUTS = (
    *("fcd", "tripinfo", "edgedata", "lanedata", "summary", "statistic", "queue", "stop"),
    *("lanechange", "emission", "collision"),
)
"""Outputs of SUMO that a run can write into its folder: SUMO's option is the name with ``-output``."""

_READS = "loopgate reads what SUMO writes"

REPLACED = {
    **dict.fromkeys(OWN_OUTPUT, _READS),
    "device.tripinfo.probability": "figures are of all vehicles",
    "time-to-teleport": "a gridlock would be hidden; see --on-deadlock",
    "time-to-teleport.highways": "a gridlock would be hidden; see --on-deadlock",
    "time-to-teleport.disconnected": "a gridlock would be hidden; see --on-deadlock",
    "time-to-teleport.remove": "no vehicle jumps or goes by itself; see --on-deadlock",
    "collision.action": "collisions are counted, and vehicles drive on",
    "collision.check-junctions": "collisions are looked for on junctions too",
    "end": "the run ends by its duration; see --duration",
    "log": "it goes into the run folder",
    "no-warnings": "they go into the run folder's log",
    "no-step-log": "loopgate shows its own progress",
    "verbose": "loopgate shows its own progress",
    "duration-log.disable": "the summary has the times",
    "start": "runs start by themselves",
    "quit-on-end": "runs end by themselves",
    "gui-settings-file": "it is for sumo-gui",
}
"""Options of a configuration that the run sets itself, and why."""

NEVER = {
    "random": "the run could not be repeated; see --seed",
    "remote-port": "loopgate steers SUMO itself",
    "num-clients": "loopgate steers SUMO itself",
    "configuration-file": "give the configuration as NETWORK",
    "net-file": "give it as NETWORK",
    "route-files": "give them by --routes or --traffic",
    "additional-files": "give them by --stops, or name them in a .sumocfg, and give that as NETWORK",
    "step-length": "see --step-length",
    "seed": "see --seed",
    "begin": "see --begin",
    "tls.all-off": "see --lights",
}
"""Options that a scenario cannot pass on, and what to do instead."""


def own_words(words: str) -> Iterator[tuple[str, str]]:
    """Yield the names and values of the options that a scenario passes on to SUMO.

    Raises
    ------
    ScenarioError
        If the text is no command line with long option names, or sets an option of the run's own.
    """
    try:
        parts = shlex.split(words)
    except ValueError as error:
        msg = f"sumo: {words!r} cannot be read ({error}); write it as on SUMO's command line"
        raise ScenarioError(msg) from error
    for part, following in zip(parts, [*parts[1:], "--"], strict=False):
        if not part.startswith("--"):
            if part.startswith("-") and not part[1:2].isdigit():
                msg = f"sumo: {part}: write options by their long names, as --fcd-output FILE"
                raise ScenarioError(msg)
            continue
        name, equals, value = part[2:].partition("=")
        if name in NEVER or name in REPLACED:
            msg = f"sumo: --{name} cannot be passed on: {(NEVER | REPLACED)[name]}"
            raise ScenarioError(msg)
        yield name, value if equals else "true" if following.startswith("--") else following
