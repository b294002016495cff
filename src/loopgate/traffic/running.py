"""Queries to a running SUMO that other code has started: its settings, its vehicles."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from loopgate.errors import SecondSimulationError, TrafficError
from loopgate.network import VehicleType
from loopgate.network.vehicle_type import vehicle_type
from loopgate.network.xml_file import open_xml
from loopgate.reading import shown
from loopgate.traffic.sumo import SumoTraffic, sumo_version

_FILES = ("route-files", "additional-files")
_MODEL = "carFollowModel"

_OLDEST = (1, 20)
"""The oldest SUMO that answers all that a gate asks."""


class RunningSumo:
    """A running simulation that other code has started and steps.

    `api`: the module ``libsumo`` or ``traci``, or a connection of the latter. Raises `TrafficError` if no
    simulation is running, or the running SUMO is older than 1.20.
    """

    def __init__(self, api: Any) -> None:  # noqa: ANN401  neither API has types
        if not hasattr(api, "vehicle"):
            msg = f"{shown(api)} is no simulation; give the module libsumo or traci, or a connection of traci"
            raise TrafficError(msg)
        self._api = api
        self._types: dict[str, ET.Element] | None = None
        self.error, reads = _backend(api)
        wrong: tuple[type[Exception], ...] = (AttributeError, *self.error)
        try:
            self.traffic = SumoTraffic(api, self.error, yields=True, reads=reads)
        except wrong as error:
            msg = f"{getattr(api, '__name__', api)}: no simulation is running; call its start() first"
            raise TrafficError(msg) from error
        version = sumo_version(api)
        if version < _OLDEST:
            said, needed = (".".join(map(str, numbers)) for numbers in (version, _OLDEST))
            msg = f"this is SUMO {said}; attach needs {needed} or newer"
            raise TrafficError(msg)

    @property
    def connection(self) -> object:
        """The module or connection; all users of one simulation share it."""
        if getattr(self._api, "__name__", "") != "traci":
            return self._api
        return self._api.connection.get("")  # the current one

    def setting(self, option: str) -> str:
        """Return the value of an option of SUMO."""
        return str(self._api.simulation.getOption(option))

    def knows(self, vehicle: str) -> bool:
        """Return whether the vehicle exists, on the road or waiting to depart."""
        try:
            self._api.vehicle.getRoute(vehicle)
        except self.error:
            return False
        return True

    def route_names(self) -> set[str]:
        """Return the names of all routes."""
        return set(self._api.route.getIDList())

    def route_name(self, vehicle: str) -> str:
        """Return the name of a vehicle's route."""
        return str(self._api.vehicle.getRouteID(vehicle)).lstrip("!")

    def seen(self) -> list[tuple[str, str, str, float, float, float, float, float]]:
        """Return for each vehicle on the road what SUMO's FCD output has of it.

        Name, type, lane, position on the lane [m], speed [m/s], x, y [m], and direction from north [degrees].
        """
        get = self._api.vehicle
        return [
            (
                *(
                    one,
                    str(get.getTypeID(one)),
                    lane,
                    float(get.getLanePosition(one)),
                    float(get.getSpeed(one)),
                ),
                *(*get.getPosition(one), float(get.getAngle(one))),
            )
            for one in get.getIDList()
            if (lane := str(get.getLaneID(one)))
        ]

    def has(self, vehicle: str, device: str) -> bool:
        """Return whether a vehicle has the SUMO device of this name."""
        return str(self._api.vehicle.getParameter(vehicle, f"has.{device}.device")) == "true"

    def type_name(self, vehicle: str) -> str:
        """Return the name of a vehicle's type; a name with an @ is a copy for this vehicle, made by SUMO."""
        return str(self._api.vehicle.getTypeID(vehicle))

    def kind(self, vehicle: str) -> VehicleType:
        """Return the type of a vehicle: from its files, with its present values.

        SUMO does not report a vehicle's car-following model, so that is read from the files.
        """
        get = self._api.vehicle
        name = str(get.getTypeID(vehicle))
        element = self._in_files(name)
        said: dict[str, str] = {_MODEL: self.setting("default.carfollowmodel")}
        if element is not None:
            read = vehicle_type(element, "route files")
            said |= read.attributes
        said |= {
            "id": name,
            "tau": f"{get.getTau(vehicle)}",
            "sigma": f"{get.getImperfection(vehicle)}",
            "accel": f"{get.getAccel(vehicle)}",
            "decel": f"{get.getDecel(vehicle)}",
            "actionStepLength": f"{get.getActionStepLength(vehicle)}",
            "width": f"{get.getWidth(vehicle)}",
        }
        return VehicleType(
            id=name,
            length_m=float(get.getLength(vehicle)),
            min_gap_m=float(get.getMinGap(vehicle)),
            vclass=str(get.getVehicleClass(vehicle)),
            attributes=said,
        )

    def _in_files(self, name: str) -> ET.Element | None:
        if self._types is None:
            files = [f for option in _FILES for f in self.setting(option).split(",") if f]
            self._types = {e.get("id", ""): e for file in files for e in _vehicle_types(Path(file))}
        return self._types.get(name) or self._types.get(name.partition("@")[0])


def _backend(api: object) -> tuple[tuple[type[Exception], ...], Mapping[str, Callable[..., Any]]]:
    """Return the exceptions of a backend, and its faster ways to read vehicles."""
    if getattr(api, "__name__", "") == "libsumo":
        from loopgate.traffic import libsumo_backend

        if libsumo_backend.owner():
            raise SecondSimulationError(libsumo_backend.owner())
        return libsumo_backend.ERROR, libsumo_backend.READS
    from loopgate.traffic import traci_backend

    return traci_backend.ERROR, {}


def _vehicle_types(file: Path) -> Iterable[ET.Element]:
    """Yield the vehicle types in a file of SUMO; none if it cannot be read."""
    try:
        with open_xml(file) as stream:
            for _, element in ET.iterparse(stream):  # noqa: S314  SUMO has read it
                if element.tag == "vType":
                    yield element
                elif element.tag in {"vehicle", "trip", "person", "flow"}:
                    element.clear()
    except (OSError, ET.ParseError):
        return
