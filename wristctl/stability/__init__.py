"""The linearised closed loop: margins, poles, and where linearisation says nothing."""
