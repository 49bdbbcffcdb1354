"""The spool as a part to make: its profile from a rig's settings, and a mesh of it for a 3D printer."""

import math
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.hw_run import RigSettings
from wristctl.errors import Argument, UserError

# Turns that stay on the spool when a tendon is paid out as far as it may be: they hold it.
_DEAD_TURNS = 2.0
# Pitch of the turns in one layer, over the tendon's diameter.
_PITCH = 1.2
# Millimetres: play of the bore on the shaft; length of the hub, which takes the set screw, and of each flange.
PLAY, HUB, FLANGE = 0.1, 8.0, 2.0
# Millimetres: wall between bore and groove, width of the groove.
_LEAST_WALL, _LEAST_WIDTH = 1.5, 3.0
# Corners of a circle in the mesh: flat sides are 1 um below the round at a radius of 7 mm.
FACETS = 180

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


class SpoolPart(NamedTuple):
    """A spool of revolution: hub, flange, groove of one layer, flange. Millimetres."""

    pulley_radius: float
    """From the axis to the middle of the tendon."""
    tendon: float
    """Diameter of the tendon."""
    turns: float
    """On the spool at most."""
    bore: float
    """Diameter."""
    core: float
    """Diameter of the groove's floor."""
    width: float
    """Of the groove."""
    flange: float
    """Diameter."""
    hub: float
    """Diameter."""

    @classmethod
    def of(cls, settings: RigSettings, tendon: float, shaft: float) -> Self:
        """The spool for `actuator.pulley_radius` and `safety.travel`, a tendon and a shaft of these diameters [mm].

        Raises UserError where the shaft leaves too little wall.
        """
        radius, travel = 1e3 * settings.actuator.pulley_radius, 1e3 * settings.safety.travel
        turns = _DEAD_TURNS + 2.0 * travel / (math.tau * radius)
        core, bore = 2.0 * radius - tendon, shaft + PLAY
        if core - bore < 2.0 * _LEAST_WALL:
            problem = f"a shaft of {shaft:g} mm leaves a wall of {0.5 * (core - bore):.1f} mm in a spool of {core:g} mm"
            fix = f"a shaft up to {core - 2.0 * _LEAST_WALL - PLAY:.1f} mm, or a larger actuator.pulley_radius"
            raise UserError(problem, Argument("shaft_mm", f"{shaft:g}"), fix)
        width = max(_LEAST_WIDTH, math.ceil(2.0 * (turns + 1.0) * _PITCH * tendon) / 2.0)
        hub = max(core, bore + 2.0 * _LEAST_WALL + 5.0)
        flange = max(2.0 * radius + 6.0 * tendon, hub) + 1.0
        return cls(radius, tendon, turns, bore, core, width, flange, hub)

    @property
    def length(self) -> float:
        """Along the axis."""
        return HUB + 2.0 * FLANGE + self.width

    @property
    def profile(self) -> Array:
        """Corners (C, 2) of half its section, counterclockwise: distance from the axis, place along it."""
        hub, flange, core, bore = (0.5 * size for size in (self.hub, self.flange, self.core, self.bore))
        first, second = HUB + FLANGE, HUB + FLANGE + self.width
        corners = [
            (bore, 0.0), (hub, 0.0), (hub, HUB), (flange, HUB), (flange, first), (core, first), (core, second),
            (flange, second), (flange, self.length), (bore, self.length),
        ]  # fmt: skip
        return np.array(corners)

    @property
    def volume(self) -> float:
        """Of the round part [mm^3]."""
        r, z = self.profile.T
        after, rise = np.roll(r, -1), np.roll(z, -1) - z
        return float(math.pi / 3.0 * np.sum((r * r + r * after + after * after) * rise))

    def mesh(self) -> Array:
        """Triangles (T, 3, 3), their corners counterclockwise seen from outside."""
        angle = math.tau * np.arange(FACETS) / FACETS
        r, z = self.profile.T
        ring = np.stack(
            [np.outer(np.cos(angle), r), np.outer(np.sin(angle), r), np.broadcast_to(z, (FACETS, len(z)))], axis=-1
        )
        beside, above = np.roll(ring, -1, axis=0), np.roll(ring, -1, axis=1)
        across = np.roll(beside, -1, axis=1)
        halves = [np.stack(corners, axis=2) for corners in ((ring, beside, across), (ring, across, above))]
        return np.concatenate([half.reshape(-1, 3, 3) for half in halves])


def write_stl(file: Path, triangles: Array, title: str) -> None:
    """Triangles (T, 3, 3) as binary STL; its numbers have no unit, printers take them for millimetres."""
    sides = triangles[:, 1:] - triangles[:, :1]
    normals = np.cross(sides[:, 0], sides[:, 1])
    records: NDArray[np.void] = np.zeros(len(triangles), _TRIANGLE)
    records["normal"] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    records["corners"] = triangles
    head = title.encode("ascii")[:80].ljust(80, b" ") + len(triangles).to_bytes(4, "little")
    file.write_bytes(head + records.tobytes())
