"""The version of wristctl: the one place it is written, which imports nothing."""

__version__ = "0.2.0.dev0"
