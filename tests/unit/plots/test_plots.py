"""Figures from tables, as a notebook makes them."""

from __future__ import annotations

import pandas as pd

from loopgate.analysis import compute_mean, compute_survival
from loopgate.plots import figure_svg, plot_edges, plot_mean, plot_survival


def test_series_may_be_any_column() -> None:
    """By default the gate; with several, sorted and the open one first."""
    runs = pd.DataFrame(
        {"gate": ["b", "open"], "lights": ["off", "keep"], "vehicles": 40, "km_per_h": [9.0, 8.0]}
    )
    by_gate = plot_mean(compute_mean(runs=runs), "km/h").legends[0]
    assert [text.get_text() for text in by_gate.get_texts()] == ["open", "b"]
    by_light = plot_mean(compute_mean(runs=runs, by=["lights", "vehicles"]), series="lights").legends[0]
    assert [text.get_text() for text in by_light.get_texts()] == ["keep", "off"]


def test_survival_with_and_without_vehicle_counts() -> None:
    """A panel per count, or a single one where counts are no column."""
    runs = pd.DataFrame(
        {"gate": "open", "vehicles": [10, 20], "first_deadlock_s": [900, None], "observed_s": 1000}
    )
    counted = plot_survival(compute_survival(runs=runs, by=["gate", "vehicles"]))
    assert [axes.get_title() for axes in counted.axes] == ["10 vehicles", "20 vehicles"]
    assert [axes.get_title() for axes in plot_survival(compute_survival(runs=runs)).axes] == [""]


def test_a_map_draws_each_series_in_which_something_is_known() -> None:
    """Figures that are missing are none."""
    edges = pd.DataFrame({"gate": ["open", "b"], "shape": "0,0 80,0", "hold_s": [None, 12.0]})
    assert [axes.get_title() for axes in plot_edges(edges, "hold_s").axes[:-1]] == ["b"]


def test_the_look_is_the_figures_own() -> None:
    """Whoever calls keeps the style that Matplotlib had; SVG holds text as text."""
    runs = pd.DataFrame({"gate": "open", "vehicles": [40], "km_per_h": [9.0]})
    text = figure_svg(plot_mean(compute_mean(runs=runs), "throughput"), "mine")
    assert ">throughput<" in text
    assert 'role="img"' in text
