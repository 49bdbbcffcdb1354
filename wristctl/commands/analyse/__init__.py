"""`analyse`: margins and poles of the linearised loop."""
