"""`python -m wristctl`: the command line under a chosen interpreter."""

from wristctl.cli.app import main

main()
