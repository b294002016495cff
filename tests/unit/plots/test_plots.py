"""Figures from tables, as a notebook makes them."""

from __future__ import annotations

import itertools
import re

import altair as alt
import numpy as np
import pandas as pd
import pytest

from loopgate.analysis import compute_flow, compute_mean, compute_survival
from loopgate.plots import figure_svg, plot_edges, plot_flow, plot_mean, plot_ranked, plot_survival
from loopgate.plots.charts import Chart
from loopgate.plots.course import OVER_TIME
from loopgate.plots.style import DARK, LIGHT, MAX_SERIES

# Machado, Oliveira and Fernandes 2009, severity 1: how those who lack a kind of cone see linear RGB.
VISION = {
    "all cones": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
TO_XYZ = np.array([[0.4125, 0.3576, 0.1804], [0.2127, 0.7152, 0.0722], [0.0193, 0.1192, 0.9503]])


def linear(colour: str) -> np.ndarray:
    part = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    xyz = TO_XYZ @ np.clip(rgb, 0, 1) / np.array([0.9505, 1.0, 1.089])
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize(("palette", "ground"), [(LIGHT, "#ffffff"), (DARK, "#16181c")])
def test_colours_can_be_told_from_the_page_and_from_each_other(palette: dict[str, str], ground: str) -> None:
    """Contrast 3:1 (WCAG 1.4.11), 4.5:1 for words; far apart in CIELAB for each kind of colour vision."""
    weights = np.array([0.2126, 0.7152, 0.0722])

    def contrast(colour: str) -> float:
        pale, dark = sorted((linear(colour) @ weights, linear(ground) @ weights), reverse=True)
        return float((pale + 0.05) / (dark + 0.05))

    series = [palette[f"s{number}"] for number in range(MAX_SERIES)]
    assert min(map(contrast, [*series, palette["heat"]])) >= 3.0
    assert min(contrast(palette[name]) for name in ("ink", "soft")) >= 4.5
    for name, seen in VISION.items():
        for one, other in itertools.combinations(series, 2):
            apart = np.linalg.norm(lab(seen @ linear(one)) - lab(seen @ linear(other)))
            assert apart > 15, (name, one, other)


def domains(chart: Chart) -> list[list[str]]:
    """Return the series that each layer's colours know."""
    layers = chart.to_dict()["layer"]
    return [part["encoding"]["color"]["scale"]["domain"] for part in layers if "color" in part["encoding"]]


def test_series_may_be_any_column() -> None:
    """By default the gate; with several, sorted and the open one first."""
    runs = pd.DataFrame(
        {"gate": ["b", "open"], "lights": ["off", "keep"], "vehicles": 40, "km_per_h": [9.0, 8.0]}
    )
    assert domains(plot_mean(compute_mean(runs=runs), "km/h"))[0] == ["open", "b"]
    by_light = plot_mean(compute_mean(runs=runs, by=["lights", "vehicles"]), series="lights")
    assert domains(by_light)[0] == ["keep", "off"]


def test_a_series_looks_the_same_in_all_figures() -> None:
    """Where only some are drawn the others keep their colours."""
    runs = pd.DataFrame({"gate": ["b"], "vehicles": 40, "km_per_h": [9.0]})
    assert domains(plot_mean(compute_mean(runs=runs), among=["open", "b"]))[0] == ["open", "b"]


def test_survival_with_and_without_vehicle_counts() -> None:
    """A panel per count, or a single one where counts are no column."""
    runs = pd.DataFrame(
        {"gate": "open", "vehicles": [10, 20], "first_deadlock_s": [900, None], "observed_s": 1000}
    )
    counted = figure_svg(plot_survival(compute_survival(runs=runs, by=["gate", "vehicles"])))
    assert ">10 vehicles<" in counted
    assert ">20 vehicles<" in counted
    assert isinstance(plot_survival(compute_survival(runs=runs)), alt.LayerChart)


def test_a_map_draws_each_series_in_which_something_is_known() -> None:
    """Figures that are missing are none."""
    edges = pd.DataFrame({"gate": ["open", "b"], "shape": "0,0 80,0", "hold_s": [None, 12.0]})
    drawn = figure_svg(plot_edges(edges, "hold_s"))
    assert ">b<" in drawn
    assert ">open<" not in drawn


def test_an_interval_stops_at_nothing() -> None:
    """Nobody drives less than 0 km: the interval of three runs, one of them poor, does not go below."""
    runs = pd.DataFrame({"gate": "open", "vehicles": 40, "km_per_h": [1.0, 50.0, 2.0]})
    assert compute_mean(runs=runs)["low"].tolist() == [0.0]
    assert compute_mean(runs=runs.assign(km_per_h=[-1.0, 50.0, 2.0]))["low"].item() < -1.0


@pytest.mark.parametrize(("most", "labels"), [(0.8, {"0", "0.2", "0.8"}), (1600.0, {"0", "200", "1.2k"})])
def test_numbers_on_axes_are_written_as_one_says_them(most: float, labels: set[str]) -> None:
    """Half an hour is 0.5 h, not 500 thousandths; nothing is 0 whatever the others are."""
    runs = pd.DataFrame({"gate": ["a", "b"], "vehicles": [1, 1], "hours": [most / 4, most]})
    drawn = figure_svg(plot_mean(compute_mean(runs=runs, value="hours", by=["gate", "vehicles"])))
    assert labels <= set(re.findall(r">([^<>]+)</text>", drawn))


@pytest.mark.parametrize("rows", [3, 4, 10])
def test_each_bar_has_its_label(rows: int) -> None:
    """Also where they are close together."""
    causes = pd.DataFrame(
        {"reason": [f"cause {n}" for n in range(rows)], "wait_s": [float(n + 1) for n in range(rows)]}
    )
    drawn = figure_svg(plot_ranked(causes, of="reason", value="wait_s"))
    assert len(re.findall(r"cause \d+</text>", drawn)) == rows


def test_a_map_names_streets_where_the_network_does() -> None:
    """The name first, the id after it; without names the id alone."""
    edges = pd.DataFrame({"gate": "open", "edge": ["a"], "shape": ["0,0 80,0"], "idleness_s": [20.0]})
    for names, fields in (({}, ["edge", "value"]), ({"street": "High Street"}, ["street", "edge", "value"])):
        spec = plot_edges(edges.assign(**names), "idleness_s").to_dict()["spec"]
        assert [field["field"] for field in spec["encoding"]["tooltip"]] == fields


def test_ticks_on_times_of_day_are_at_full_quarters() -> None:
    """As on a clock, and not at multiples of a thousand seconds."""
    over = pd.DataFrame(0.0, index=range(2), columns=list(OVER_TIME)).assign(time_s=[34260.0, 41400.0])
    panel = plot_flow(over, clock=True).to_dict()["vconcat"][0]["layer"][0]
    assert panel["encoding"]["x"]["axis"]["values"] == [900 * quarter for quarter in range(39, 47)]


def test_where_nobody_drives_rounds_there_is_no_panel_of_laps() -> None:
    """As of FCD; with one lap it is there."""
    flow = pd.DataFrame({"time_s": [10.0, 20.0], "vehicles": 4, "standing": [0, 2], "distance_m": 400.0})
    for laps, panels in ((0, 3), (1, 4)):
        made = compute_flow(flow=flow.assign(laps=laps), every_s=10)
        assert len(plot_flow(made).to_dict()["vconcat"]) == panels
