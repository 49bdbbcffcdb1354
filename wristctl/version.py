"""The version of wristctl: the one place it is written, which imports nothing."""

__version__ = "0.1.0"
