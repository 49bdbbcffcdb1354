"""Run directories: one sealed folder per command, which says what was run on what, and what came out."""

from wristctl.records.find import list_runs, open_run, require
from wristctl.records.run import Run
from wristctl.records.run_writer import LiveRun
from wristctl.records.start import InputRun, start_run
from wristctl.seeds import stream

__all__ = ["InputRun", "LiveRun", "Run", "list_runs", "open_run", "require", "start_run", "stream"]
