"""Figures of a study: what is written on a colour can be read."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import to_rgb

from tests.comparison.test_fair_answer import ranked, row
from wristctl.commands.study.figures import laws_by_rig

LUMINANCE = np.array([0.299, 0.587, 0.114])


def test_every_ratio_can_be_read_on_its_cells_colour() -> None:
    """From 40 times worse than feedforward to 40 times better, the ends of the colours and their middle."""
    factors = (0.025, 0.1, 0.5, 2.0, 10.0, 40.0)
    rows = [row(f"law{k}/tuned", 4.0 * factor) for k, factor in enumerate(factors)]
    rows += [row(f"lost{k}/tuned", 4.0 * factor, swings=9) for k, factor in enumerate(factors)]
    (axes, *_) = laws_by_rig({"bench": ranked(*rows)}).axes
    (drawn,) = axes.images
    cells = np.asarray(drawn.to_rgba(np.asarray(drawn.get_array())))[..., :3].reshape(-1, 3) @ LUMINANCE
    inks = np.array([np.array(to_rgb(text.get_color())) @ LUMINANCE for text in axes.texts])
    assert len(inks) == len(cells) == 13 and np.ptp(cells) > 0.3
    assert np.abs(inks - cells).min() > 0.35


def test_what_nothing_beats_is_bold_and_what_must_not_be_used_is_slanted() -> None:
    rows = [row("a/tuned", 1.0), row("bb/tuned", 2.0), row("ccc/tuned", 0.5, swings=9)]
    (axes, *_) = laws_by_rig({"bench": ranked(*rows)}).axes
    names = [label.get_text() for label in axes.get_yticklabels()]
    looks = {names[int(text.get_position()[1])]: (text.get_fontweight(), text.get_fontstyle()) for text in axes.texts}
    assert looks == {
        "a/tuned": ("bold", "normal"), "bb/tuned": ("normal", "normal"), "ccc/tuned": ("normal", "italic"),
        "feedforward/default": ("normal", "normal"),
    }  # fmt: skip
