"""`audit`: the paper's claims, one by one."""
