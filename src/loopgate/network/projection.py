"""Longitude and latitude of points of a network, by the projection that its file names."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pyproj

from loopgate.arrays import Floats
from loopgate.errors import NetworkError
from loopgate.network.road import RoadNetwork
from loopgate.network.xml_file import open_xml
from loopgate.reading import refusing, shown

_UNPROJECTED = frozenset({"", "!", "-", "."})
"""SUMO's words for no projection, or a projection without a name."""


@dataclass(frozen=True)
class Projection:
    """The map from coordinates of a network to longitude and latitude (WGS 84).

    Attributes
    ----------
    file
        The network's file, for messages.
    parameter
        The projection in PROJ's words, such as ``+proj=utm +zone=33 +datum=WGS84``.
    offset_m
        Offset of the network's coordinates from the projected coordinates, x and y [m].

    Examples
    --------
    >>> from loopgate import RoadNetwork
    >>> from loopgate.network.projection import Projection
    >>> projection = Projection.of(RoadNetwork.open("sumo:DRT"))
    >>> projection.lonlat([(0.0, 0.0)]).round(4).tolist()
    [[13.5099, 52.4251]]
    """

    file: Path
    parameter: str
    offset_m: tuple[float, float]

    @classmethod
    def of(cls, network: RoadNetwork) -> "Projection":
        """Read the projection of a network.

        Raises `NetworkError` if the network has none, or PROJ does not know it.
        """
        file = network.file
        with refusing(file, "network", NetworkError), open_xml(file) as stream:
            location = next(
                (element.attrib for _, element in ET.iterparse(stream) if element.tag == "location"),  # noqa: S314
                {},
            )
            parameter = location.get("projParameter", "")
            offset = tuple(float(part) for part in location.get("netOffset", "0,0").split(","))
        if parameter.strip() in _UNPROJECTED:
            msg = (
                f"{file}: the network has no geographic projection (projParameter is {shown(parameter)}), so "
                "its points have no longitude and latitude; make it from geographic data, or with netconvert "
                "--proj and --offset"
            )
            raise NetworkError(msg)
        made = cls(file, parameter, (offset[0], offset[1]))
        _ = made._transformer  # it is refused here, before anything is written
        return made

    @cached_property
    def _transformer(self) -> Any:  # noqa: ANN401 - pyproj's own type is made by Cython
        try:
            plane = pyproj.CRS.from_user_input(self.parameter)
            return pyproj.Transformer.from_crs(plane, plane.geodetic_crs, always_xy=True)
        except pyproj.exceptions.ProjError as error:
            msg = f"{self.file}: PROJ does not know the projection {shown(self.parameter)}"
            raise NetworkError(msg) from error

    def plane(self, points: Any) -> Floats:  # noqa: ANN401 - as below
        """Return the network's coordinates [m] of points of longitude and latitude, both of shape (n, 2)."""
        there = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        back = self._transformer.transform(there[:, 0], there[:, 1], direction="INVERSE")
        return np.asarray(np.column_stack(back) + np.asarray(self.offset_m))

    def lonlat(self, points: Any) -> Floats:  # noqa: ANN401 - anything that becomes an array of points
        """Return longitude and latitude [degrees] of points [m], both of shape (n, 2)."""
        plane = np.asarray(points, dtype=np.float64).reshape(-1, 2) - np.asarray(self.offset_m)
        return np.column_stack(self._transformer.transform(plane[:, 0], plane[:, 1]))
