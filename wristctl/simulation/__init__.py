"""Closed loops: references, the compiled rollout, trajectories and metrics."""
