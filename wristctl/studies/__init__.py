"""What each command reads, computes and writes: as a run directory, or as a result in memory."""
