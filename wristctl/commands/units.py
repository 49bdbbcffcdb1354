"""Units of work within a run: given to the session's workers, kept in the run, taken over from one that was stopped."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

from wristctl.commands.adoption import adoption, sources_in
from wristctl.commands.session import Session
from wristctl.work.executors import Workers
from wristctl.work.fan_out import UnitsDone, perform_units
from wristctl.work.worker import UNITS, Computed, Furnish, Golden, Unit

log = logging.getLogger(__name__)


def performed(
    session: Session,
    command: str,
    task: str,
    units: Sequence[Unit],
    golden: Golden | None,
    counted: str = "rollouts",
    then: float = 0.0,
    after: float = 0.0,
) -> UnitsDone:
    """Compute a command's units with the session's workers, into the run where there is one, and show the progress.

    All workers must reproduce the `golden` numbers. The hashes of laws from elsewhere are part of the units'
    specifications. What the units' sizes are of is `counted`; `then` and `after` are those of `Session.progress`.
    """
    from wristctl.work.worker import code_digest

    run, stopped = session.findings.run, session.inputs.runs().get("resume")
    folder, earlier = (source.path / UNITS if source else None for source in (run, stopped))
    first = folder is None or not folder.exists()
    if first and stopped is not None and stopped.manifest.code.tree_sha256 != code_digest():
        log.warning("%s was made by other code: none of its units can be kept, all are computed anew", stopped.id)
    if folder is not None:
        folder.mkdir(exist_ok=True)
    furnish = None
    if sources := sources_in(session.study):
        units = [replace(unit, spec={**unit.spec, "sources": sources}) for unit in units]
        furnish = Furnish("wristctl.commands.adoption:adopt", adoption(session.study, command))
    count = kept = 0
    with session.progress(task, sum(unit.size for unit in units), counted, then, after) as report:

        def told(unit: Unit, computed: Computed | None) -> None:
            nonlocal count, kept
            count += unit.size
            kept += unit.size * (computed is None)
            report(count, kept)
            if computed is not None:
                spent = {"host": computed.host, "seconds": computed.seconds, "processor": computed.processor}
                session.findings.event("unit", name=unit.name, key=unit.key, **{counted: unit.size}, **spent)

        results = perform_units(units, Workers.of(session.executor), golden, folder, earlier, told, furnish)
    if run is not None and stopped is not None:
        run.took_over(stopped.id, len(results.taken_over), int(results.tried_again is not None))
    for lost in results.poisoned:
        session.findings.event("warning", message=f"{lost.unit.name} was given up: {lost.why}")
    return results
