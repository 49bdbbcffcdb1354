"""What each command plans, computes, says and draws: as a run directory, or as a result in memory."""
