"""What studies gates and drives nothing: theory, state space, runs, agents, the paper."""

from loopgate.kernel_cache import forget_stale_kernels

forget_stale_kernels()
