"""The part that studies gates and drives nothing: theory, state space, runs, the paper."""
