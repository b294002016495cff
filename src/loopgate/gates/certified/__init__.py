"""The certified gate and its parts."""

from loopgate.gates.certified.gate import CertifiedGate

__all__ = ["CertifiedGate"]
