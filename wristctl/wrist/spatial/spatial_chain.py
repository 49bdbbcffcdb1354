"""Parts of a wrist in two planes as a chain: chords and springs, which the dynamics take from the parts' type.

Each part bends by a vector u of its own, without twist. Its chord, from one disc's centre to the next one's, is so many
times a length along the tangent t before it and along nu = u_y n_y + u_z n_z. Masses are at the chords' middles.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import by_type, implements
from wristctl.wrist.spatial.spatial_segments import SpatialSegments
from wristctl.wrist.spatial.stumpff import slopes


class Chord(NamedTuple):
    """A part's chord over `chord_unit`: along the tangent before it, and along nu; functions of |u|^2.

    The first slope is a derivative by a component u_i over that u_i, the second is the first one's again.
    """

    along: Any
    lean: Any
    along_1: Any
    lean_1: Any
    along_2: Any
    lean_2: Any
    along_3: Any
    lean_3: Any


@by_type
def chord_unit(segment: Any) -> Any:
    """Length that chords are told in [m]."""


@by_type
def chord_of(segment: Any, c: Any) -> Any:
    """Chord of a part, from Stumpff's functions c of its bend."""


@by_type
def springs_of(segment: Any, k: int) -> Any:
    """Stiffness of the part k from the base: yy, yz and zz [N m/rad]."""


@implements(chord_unit, SpatialSegments)
def _arc(segment: Any) -> Any:
    return segment.length


@implements(chord_of, SpatialSegments)
def _chord_of_arc(segment: Any, c: Any) -> Any:
    d = slopes(c)
    e1, e2, e3, e4 = d.d3 - d.d2, 2.0 * d.d4 - d.d3, 3.0 * d.d5 - d.d4, 4.0 * d.d6 - d.d5
    return Chord(c.c1, c.c2, d.d1, d.d2, e1, e2, e3 - e2, 2.0 * e4 - e3)


@implements(springs_of, SpatialSegments)
def _equal_springs(segment: Any, k: int) -> Any:
    return segment.stiffness_yy, segment.stiffness_yz, segment.stiffness_zz
