"""How a table for readers, or an axis, is headed: words for a column, with its unit."""

from collections.abc import Mapping

from loopgate.results import columns as c

_UNITS: Mapping[str, str] = {
    "_veh_per_km": "veh/km",
    "_veh_per_h": "veh/h",
    "_km_per_h": "km/h",
    "_per_h": "1/h",
    "_mps": "m/s",
    "_us": "\N{MICRO SIGN}s",
    "_mb": "MiB",
    "_km": "km",
    "_m": "m",
    "_s": "s",
    "_h": "h",
}
_HEADINGS: Mapping[str, str] = {
    c.KM_PER_H: "throughput [veh km/h]",
    c.KM_PER_H_MEASURED: "throughput until its end [veh km/h]",
    c.SPEED: "mean speed [km/h]",
    c.STOOD: "standing [veh s]",
    c.STOOD_H: "standing so far [veh h]",
    c.STOOD_SHARE: "share of vehicle time standing",
    c.LOST: "time lost [veh h]",
    c.LAP_TIME: "lap time [s]",
    c.CAPACITY: "capacity [vehicles]",
    c.RATE: "runs that lock up",
    c.SURVIVAL: "runs not yet locked up",
    c.LATENESS: "late, median [s]",
    c.WORST_LATENESS: "late, worst [s]",
    c.ON_TIME_60: "within a minute",
    c.ON_TIME_120: "within two minutes",
    c.PERSONS: "persons waiting",
    c.PERSONS_MOST: "most persons waiting",
    c.LED: "times led round",
    c.LONGER: "longer way [m]",
    c.LATER: "took longer [s]",
    c.SHUT_WAIT: "waited before it [s]",
    c.SHUT_QUEUE: "behind one that waited [s]",
    c.DELAY_95: "delay, 95 % [s]",
    c.GREEN_USED: "share of green used",
    c.QUEUE: "queue, mean",
    c.QUEUE_95: "queue, 95 %",
    c.QUEUE_MOST: "queue, longest",
    c.WORST_IDLENESS: "longest time unseen [s]",
}


def heading(column: str) -> str:
    """Return the words for a column, with its unit as papers write it.

    Examples
    --------
    >>> heading("density_veh_per_km"), heading("mean_delay_s"), heading("level_of_service")
    ('density [veh/km]', 'mean delay [s]', 'level of service')
    """
    if column in _HEADINGS:
        return _HEADINGS[column]
    for end, unit in _UNITS.items():
        if column.endswith(end) and column != end:
            return f"{column.removesuffix(end).replace('_', ' ')} [{unit}]"
    return column.replace("_", " ")


def clock(time_s: float) -> str:
    """Return a time of SUMO as a time of day.

    Examples
    --------
    >>> clock(36150.0), clock(90000.0)
    ('10:02:30', '25:00:00')
    """
    minutes, seconds = divmod(round(time_s), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d}"
