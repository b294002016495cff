"""The part that studies gates and drives nothing: theory, state space, runs, agents, the paper."""

import loopgate.kernel_cache  # noqa: F401  says where compiled code is kept, before there is any
