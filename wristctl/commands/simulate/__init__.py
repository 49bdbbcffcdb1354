"""`simulate`: one closed loop."""
