"""Commands: plan, computation, words and figures of each, as a run directory or as a result in memory."""
