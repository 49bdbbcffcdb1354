"""Run directories: one sealed folder per command, which says what was run on what, and what came out."""

from wristctl.runs.find import list_runs, open_run, require
from wristctl.runs.live import LiveRun, stream
from wristctl.runs.run import Run
from wristctl.runs.start import InputRun, start_run

__all__ = ["InputRun", "LiveRun", "Run", "list_runs", "open_run", "require", "start_run", "stream"]
