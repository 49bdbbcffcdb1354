"""The audit over the box of what the paper leaves open: what was drawn, where each claim holds, and its figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wristctl.report.printed_table import Table
from wristctl.studies.session import Session

if TYPE_CHECKING:
    from wristctl.comparison.robust import Strip


def judged_in_box(session: Session) -> list[Strip]:
    """Every claim that draws can judge; none where the study names no unknowns."""
    from wristctl.comparison.box import continuous_settings, drawn_settings, react
    from wristctl.comparison.robust import draws_frame, rows_in_box, strips, strips_frame
    from wristctl.config.sweeps import unit_at
    from wristctl.control.table import CONTROLLERS
    from wristctl.report.strip_figures import shares, strip

    study, findings, box = session.study, session.findings, session.study.audit.box
    claims = [claim for claim in study.audit.claims if claim.controller is None or claim.controller in CONTROLLERS]
    rows = rows_in_box(claims)
    if not box.unknowns or not rows:
        return []
    turned = {claim.label for claim in claims if claim.evidence == "symmetry"}
    settings = [*drawn_settings(box, study.wrist, study.seed), *continuous_settings(box, study.wrist, study.seed)]
    with session.progress("drawing settings from the box", total=100, unit="%") as done:
        share = len(rows) / (len(rows) + len(turned))
        drawn = react(rows, settings, lambda part: done(round(100 * share * part)))
        rest = [row for row in rows if row.label in turned]
        mirrored = react(rest, settings, lambda part: done(round(100 * (share + (1 - share) * part))), mirrored=True)
    found = strips(claims, drawn, mirrored)
    findings.table("data/box.csv", strips_frame(found))
    findings.table("data/draws.csv", draws_frame(drawn))
    own = [each for each in found if not each.claim.unspecified or each.claim.evidence == "symmetry"]
    heading = "In which of the settings that the paper may have had its claims hold"
    findings.figure("box", shares, own or found, heading)
    for each in found:
        if each.leaves:
            name = each.leaves[0].name
            within = study if name.startswith("wrist.") else study.simulate
            unit = unit_at(within, name.split("."))
            findings.figure(f"strip-{each.claim.id}", strip, each, drawn.values(name), unit, later=True)
    return found


def box_table(found: list[Strip]) -> Table:
    """Where each claim holds, and what decides it."""
    from wristctl.comparison.verdicts import FAILING

    rows = []
    for each in found:
        held = each.share("reproduced")
        beside = (each.share("better than the paper").value, each.share(*FAILING).value)
        second = each.leaves[1].name if each.told and len(each.leaves) > 1 else ""
        rows.append((each.claim.id, each.uncounted, held.value, held.low, held.high, *beside, each.told, second))
    heads = ("claim", "not converged", "holds in", "95 % low", "high", "better in", "fails in", "decided by", "then by")
    draws = len(found[0].verdicts) if found else 0
    most = max((each.uncounted for each in found), default=0)
    left = f"; those that did not converge, up to {most}, are not counted" * bool(most)
    return Table(f"Shares of {draws} settings drawn from what the paper leaves open{left}", heads, rows)
