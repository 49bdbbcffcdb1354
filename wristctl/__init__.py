"""wristctl: experiments with tendon-driven soft prosthetic wrists, from model to motors."""

__version__ = "0.1.0"
