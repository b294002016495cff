"""What studies gates and drives nothing: theory, state space, robots as agents, the paper."""
