"""Section 5 of Zhou et al. 2020 again: every printed figure with ours beside it."""

from loopgate.research.paper.report import reproduce

__all__ = ["reproduce"]
