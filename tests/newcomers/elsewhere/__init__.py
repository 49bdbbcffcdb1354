"""A package of strangers, who add to wristctl without touching it."""
