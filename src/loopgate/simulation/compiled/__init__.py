"""The gated drive in compiled code: the commonest case, certified by the chain rule alone, at speed."""

from loopgate.kernel_cache import forget_stale_kernels

forget_stale_kernels()
