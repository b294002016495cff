"""The certified gate and what it is made of."""

from loopgate.gates.certified.gate import CertifiedGate

__all__ = ["CertifiedGate"]
