"""Fig. 11, Fig. 12 and the curve of Section 5.1, drawn from our figures."""

from pathlib import Path

import matplotlib as mpl
import networkx as nx
from matplotlib.figure import Figure

from loopgate.disk import writing
from loopgate.research.paper import printed
from loopgate.research.paper.section5 import Evolution
from loopgate.research.runs import RoundCounts
from loopgate.research.theory.digraph import digraph
from loopgate.research.theory.instances import instance

_COLOURS = mpl.colormaps["tab10"].colors  # type: ignore[attr-defined] # listed colour maps have it


def draw_live_rounds(means: dict[int, float], exact: float, file: Path) -> None:
    """Draw the share of live rounds over the number of rounds: printed, ours, exact."""
    figure = Figure(figsize=(6, 3.5), layout="constrained")
    axes = figure.subplots()
    sizes = list(printed.LIVE_ROUNDS)
    axes.semilogx(sizes, [printed.LIVE_ROUNDS[n] / n for n in sizes], "s--", label="printed")
    axes.semilogx(sizes, [means[n] / n for n in sizes], "o-", label="ours")
    axes.axhline(exact, color="black", linewidth=0.8, label=f"exact, {exact:.4f}")
    axes.set(xlabel="rounds of an experiment", ylabel="share of live rounds", ylim=(0.27, 0.34))
    axes.legend()
    with writing(file):
        figure.savefig(file, dpi=150)


def draw_fig11(rounds: RoundCounts, file: Path) -> None:
    """Draw the mean time of a decision per robot [ms]."""
    figure = Figure(figsize=(6, 3.5), layout="constrained")
    axes = figure.subplots()
    times = {name: spent["mean"] / 1000 for name, spent in rounds.decision_us.items()}
    axes.bar(list(times), list(times.values()))
    axes.set(ylabel="mean decision time [ms]", title=f"Fig. 11 on this machine, {rounds.rounds} rounds")
    with writing(file):
        figure.savefig(file, dpi=150)


def draw_fig12(made: Evolution, file: Path) -> None:
    """Draw the snapshots of the printed evolution; a state that a robot stands in carries its index."""
    system = instance("fig10")
    graph = digraph(system)
    places = nx.kamada_kawai_layout(nx.Graph(graph))
    figure = Figure(figsize=(16, 8), layout="constrained")
    for axes, (panel, (step, _)) in zip(figure.subplots(2, 4).flat, printed.SNAPSHOTS.items(), strict=True):
        standing = {
            state: number for number, state in enumerate(system.describe(made.configurations[step]), start=1)
        }
        for here, there, data in graph.edges(data=True):
            colour: int = data["colour"]
            axes.annotate(
                "",
                places[there],
                places[here],
                arrowprops={"arrowstyle": "->", "color": _COLOURS[colour], "shrinkA": 6, "shrinkB": 6},
            )
        for state, (x, y) in places.items():
            number = standing.get(state)
            private = state.endswith("_0")
            axes.plot(x, y, "o", ms=13, mfc="white" if number is None else _COLOURS[number - 1], mec="black",
                      ls="", mew=0.5 if private else 1.2)  # fmt: skip
            axes.annotate(state if number is None else str(number), (x, y), ha="center", va="center",
                          fontsize=5 if number is None else 8)  # fmt: skip
        axes.set_title(f"({panel}) after {step} moves", fontsize=9)
        axes.set_axis_off()
    with writing(file):
        figure.savefig(file, dpi=110)
