"""The spool that follows from a rig's settings is a closed body with the tendon at the pulley's radius."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings, Safety
from wristctl.config.plant import Actuator
from wristctl.errors import UserError
from wristctl.trial.spool_part import FACETS, SpoolPart, write_stl


def spool_of(radius: float = 7.5e-3, tendon: float = 0.7, shaft: float = 6.35, travel: float = 0.02) -> SpoolPart:
    actuator, safety = Actuator(level="tendon", pulley_radius=radius), Safety(travel=travel)
    return SpoolPart.of(HwRunSettings(actuator=actuator, safety=safety), tendon, shaft)


def read_stl(file: Path) -> tuple[Array, Array]:
    """Normals (T, 3) and triangles (T, 3, 3) of a binary STL file, field by field."""
    data = file.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    assert len(data) == 84 + 50 * count
    numbers = np.array([np.frombuffer(data, "<f4", 12, 84 + 50 * k) for k in range(count)], float)
    return numbers[:, :3], numbers[:, 3:].reshape(-1, 3, 3)


def volume_of(triangles: Array) -> float:
    """By the divergence theorem: negative where corners run the wrong way round."""
    return float(np.einsum("ti,ti->", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6.0)


@pytest.mark.parametrize(("radius", "tendon", "shaft"), [(7.5e-3, 0.7, 6.35), (15e-3, 0.5, 5.0), (6e-3, 1.0, 5.0)])
def test_the_printed_spool_is_closed_and_has_the_volume_of_its_section(
    tmp_path: Path, radius: float, tendon: float, shaft: float
) -> None:
    spool = spool_of(radius, tendon, shaft)
    write_stl(tmp_path / "spool.stl", spool.mesh(), "a spool")
    normals, triangles = read_stl(tmp_path / "spool.stl")
    corners = [[tuple(corner) for corner in triangle] for triangle in triangles.tolist()]
    edges = Counter((one[k], one[(k + 1) % 3]) for one in corners for k in range(3))
    assert set(edges.values()) == {1} and all((b, a) in edges for a, b in edges), "each edge once in each direction"
    vertices = {corner for one in corners for corner in one}
    assert len(vertices) - len(edges) // 2 + len(triangles) == 0, "one body with one hole"
    faceted = FACETS / math.tau * math.sin(math.tau / FACETS)  # a polygon's area over its circle's
    assert volume_of(triangles) == pytest.approx(faceted * spool.volume, rel=1e-6)
    assert volume_of(triangles) == pytest.approx(spool.volume, rel=3e-4)
    outward = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    assert np.einsum("ti,ti->t", normals, outward) == pytest.approx(np.linalg.norm(outward, axis=1), rel=1e-4)
    reach = np.hypot(triangles[..., 0], triangles[..., 1])
    assert 2.0 * reach.max() == pytest.approx(spool.flange, rel=1e-6)
    assert 2.0 * reach.min() == pytest.approx(shaft + 0.1, rel=1e-6)
    assert np.ptp(triangles[..., 2]) == pytest.approx(spool.length, rel=1e-6)


def test_the_volume_of_the_section_is_that_of_its_four_rings() -> None:
    spool = spool_of()
    rings = ((spool.hub, 8.0), (spool.flange, 2.0), (spool.core, spool.width), (spool.flange, 2.0))
    expected = sum(math.pi / 4.0 * (outer**2 - spool.bore**2) * length for outer, length in rings)
    assert spool.volume == pytest.approx(expected, rel=1e-12)


@given(st.floats(4e-3, 30e-3), st.floats(0.3, 1.5), st.floats(3.0, 10.0), st.floats(5e-3, 0.1))
def test_the_tendon_lies_at_the_pulleys_radius_and_all_of_it_in_one_layer(
    radius: float, tendon: float, shaft: float, travel: float
) -> None:
    assume(2e3 * radius - tendon - shaft > 3.2)
    spool = spool_of(radius, tendon, shaft, travel)
    assert 0.5 * (spool.core + tendon) == pytest.approx(1e3 * radius), "its middle"
    wound = spool.turns * math.tau * radius
    assert wound >= 2.0 * travel + 2.0 * math.tau * radius - 1e-9, "both ways of travel, and two turns that stay"
    assert spool.turns * tendon < spool.width and spool.flange > 2e3 * radius + 2.0 * tendon
    assert spool.hub >= spool.core > spool.bore + 2.9 and spool.flange > spool.hub


def test_a_shaft_that_is_too_thick_for_the_pulley_is_refused_with_the_thickest_that_fits() -> None:
    with pytest.raises(UserError) as refused:
        spool_of(radius=5e-3)
    thickest = float(refused.value.fix.split(" up to ")[1].split(" mm")[0])
    assert "--shaft-mm" in refused.value.where
    assert spool_of(radius=5e-3, shaft=thickest).bore == pytest.approx(thickest + 0.1)
    with pytest.raises(UserError):
        spool_of(radius=5e-3, shaft=thickest + 0.2)
