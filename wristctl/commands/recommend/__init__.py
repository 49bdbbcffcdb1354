"""A controller with gains for one wrist and rig: `wristctl recommend`."""
