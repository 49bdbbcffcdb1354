"""The wrist as a URDF for viewers: the chain of rigid links with universal joints, without springs and tendons.

Links, joints and their names are those of the model for MuJoCo (`wristctl.wrist.hinge_chain`): the angles of one move
the other. x is along the straight wrist, y toward ulnar, z toward flexion; the base is `wrist_base`, the middle of the
last disc `wrist_tip`. A joint in two planes is two revolute joints with an empty link between them.
"""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree

import numpy as np

from wristctl.arrays import Array
from wristctl.records.ros_bags import BASE_FRAME
from wristctl.wrist.hinge_chain import HingeChain

TIP = "wrist_tip"
"""Link in the middle of the last disc."""
# How far joints go beyond their share of the bending range, and the effort and speed that viewers do not use.
_BEYOND, _EFFORT, _SPEED = 1.5, 10.0, 20.0
# Half thickness of a disc, radius of the hand [m], share of the discs' radius that a tube has.
_DISC, _HAND, _TUBE = 0.0015, 0.02, 0.6
# Mass and inertia of a link that has none of its own, which readers want not to be 0.
_NO_MASS, _NO_INERTIA = 1e-6, 1e-9
_TUBES, _DISCS, _HANDS = "0.85 0.75 0.6 1", "0.25 0.3 0.35 1", "0.6 0.65 0.7 0.6"


def urdf(chain: HingeChain, range_deg: float, about: str) -> str:
    """The chain as a URDF; `range_deg` is how far the whole wrist bends, `about` says where the numbers come from."""
    root = ElementTree.Element("robot", name="wrist")
    root.append(ElementTree.Comment(f" For viewers: rigid links, no tendons. {re.sub('-{2,}', '-', about)} "))
    rim = max(math.hypot(tendon.y, tendon.z) for tendon in chain.tendons)
    base = _link(root, BASE_FRAME, 0.0)
    _tube(base, 0.5 * chain.length, rim)
    _disc(base, 0.0, rim)
    most = _BEYOND * math.radians(range_deg) / chain.links
    before = BASE_FRAME
    for k in range(1, chain.links + 1):
        last, order = k == chain.links, chain.order(k)
        for number, p in enumerate(order):
            name, axis = chain.hinges[p]
            whole = number == len(order) - 1
            link = f"link{k}" if whole else f"link{k}_between"
            body = _link(root, link, (chain.hand_mass if last else chain.mass) if whole else 0.0)
            place = (0.5 * chain.length if k == 1 else chain.length) if number == 0 else 0.0
            joint = _joint(root, f"hinge{k}{name}", before, link, place, "revolute")
            ElementTree.SubElement(joint, "axis", xyz=" ".join(f"{value:.17g}" for value in axis))
            limit = {"lower": f"{-most:.6g}", "upper": f"{most:.6g}", "effort": str(_EFFORT), "velocity": str(_SPEED)}
            ElementTree.SubElement(joint, "limit", limit)
            first = chain.alike * ((k - 1) // chain.alike) + 1
            if k != first:
                ElementTree.SubElement(joint, "mimic", joint=f"hinge{first}{name}", multiplier="1", offset="0")
            before = link
            if whole:
                _tube(body, 0.5 * chain.length if last else chain.length, rim)
                _disc(body, 0.5 * chain.length, rim)
            if last and whole:
                _visual(body, chain.beyond, "sphere", {"radius": str(_HAND)}, _HANDS)
    _link(root, TIP, 0.0)
    _joint(root, "tip", before, TIP, 0.5 * chain.length, "fixed")
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def joint_angles(chain: HingeChain, bend: Array) -> dict[str, Array]:
    """Angles (T,) [rad] of the joints of a chain in two planes, by their names, of a wrist that bends evenly.

    `bend` (T, 2) [rad] is the bend of the last disc toward ulnar and flexion. Every joint bends by the same angle in
    the same plane; what two revolute joints twist is taken up by the ones that follow.
    """
    c, s = math.cos(chain.axis), math.sin(chain.axis)
    along = bend @ np.array([[c, -s], [s, c]])
    angle = np.linalg.norm(along, axis=1)
    toward = along / np.where(angle > 0.0, angle, 1.0)[:, None]
    frame, found = np.broadcast_to(np.eye(3), (len(bend), 3, 3)), dict[str, Array]()
    for k in range(1, chain.links + 1):
        turned = angle * k / chain.links
        tangent = np.concatenate([np.cos(turned)[:, None], np.sin(turned)[:, None] * toward], axis=1)
        x, y, z = np.einsum("tij,ti->jt", frame, tangent)
        first_y = chain.order(k) == (0, 1)
        a, b = (np.arctan2(y, x), np.arcsin(z)) if first_y else (np.arcsin(y), np.arctan2(z, x))
        found[f"hinge{k}y"], found[f"hinge{k}z"] = a, b
        for toward_y in (first_y, not first_y):
            frame = frame @ _turn(a if toward_y else b, toward_y)
    return found


def _turn(angle: Array, toward_y: bool) -> Array:
    """Rotations (T, 3, 3) of x toward y, or toward z."""
    turn = np.broadcast_to(np.eye(3), (len(angle), 3, 3)).copy()
    q = 1 if toward_y else 2
    turn[:, 0, 0] = turn[:, q, q] = np.cos(angle)
    turn[:, q, 0] = np.sin(angle)
    turn[:, 0, q] = -turn[:, q, 0]
    return turn


def _link(root: ElementTree.Element, name: str, mass: float) -> ElementTree.Element:
    link = ElementTree.SubElement(root, "link", name=name)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "mass", value=repr(mass or _NO_MASS))
    moments = dict.fromkeys(("ixx", "iyy", "izz"), str(_NO_INERTIA)) | dict.fromkeys(("ixy", "ixz", "iyz"), "0")
    ElementTree.SubElement(inertial, "inertia", moments)
    return link


def _joint(
    root: ElementTree.Element, name: str, parent: str, child: str, place: float, kind: str
) -> ElementTree.Element:
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    ElementTree.SubElement(joint, "origin", xyz=f"{place:.17g} 0 0", rpy="0 0 0")
    return joint


def _tube(link: ElementTree.Element, length: float, rim: float) -> None:
    """A tube along x, from the link's origin."""
    _visual(link, 0.5 * length, "cylinder", {"radius": f"{_TUBE * rim:.6g}", "length": f"{length:.6g}"}, _TUBES)


def _disc(link: ElementTree.Element, place: float, rim: float) -> None:
    _visual(link, place, "cylinder", {"radius": f"{rim:.6g}", "length": str(2.0 * _DISC)}, _DISCS)


def _visual(link: ElementTree.Element, place: float, shape: str, size: dict[str, str], colour: str) -> None:
    """A shape on the x axis; URDF's cylinders stand along z."""
    visual = ElementTree.SubElement(link, "visual")
    ElementTree.SubElement(visual, "origin", xyz=f"{place:.6g} 0 0", rpy=f"0 {0.5 * math.pi:.9g} 0")
    ElementTree.SubElement(ElementTree.SubElement(visual, "geometry"), shape, size)
    ElementTree.SubElement(ElementTree.SubElement(visual, "material", name=shape + colour[:3]), "color", rgba=colour)
