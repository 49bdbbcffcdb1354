"""Controllers: one file each, one line in the table of `wristctl.control.table`."""
