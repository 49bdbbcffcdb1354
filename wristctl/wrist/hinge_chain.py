"""The wrist as a chain of rigid links for other simulators: MuJoCo's model, and equations of motion for MATLAB.

Between two discs there are two straight halves with a joint, spring and damper between them; masses sit at the joints,
the hand's at the end. In one plane a joint is a hinge, in two a universal joint: two hinges, whose order changes from
joint to joint, so that the links' twists cancel out. Joints of one segment bend alike. Tendons pass two holes a joint,
at +-l/(6 g^2) from it, l a link's length and g the straight pieces of tendon on it: so far from it their length falls
with the bend as that of the arc's tendons, to third order. (Through holes in the discs they would squeeze the chain
three times as much.) A wrist of rigid links has its tendons there, and springs that may be softer from joint to joint.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import NamedTuple
from xml.etree import ElementTree

from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.wrist.hinges import tapered
from wristctl.wrist.segments import Segments, segments
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# MuJoCo's integration step [s], and the one for stiff tendons on spools.
_STEP, _FINE_STEP = 1e-3, 1e-4
_RIM = 1.25
# Time constant and damping of the tie between hinges that bend alike: two steps, the fastest that MuJoCo holds stable.
_TIE = "0.002 1"
# Pull [N] that no tendon comes to: MuJoCo wants an end of a range.
_NO_LIMIT = 1e6


class Tendon(NamedTuple):
    """Tendons alike at one place of the cross-section."""

    name: str
    y: float
    """[m] toward positive angles of the first plane."""
    z: float
    many: int
    joints: int
    """Joints that it runs past, from the base."""


class Spools(NamedTuple):
    """Motors that hold lengths of elastic tendons, and the tendons' friction."""

    stiffness: float
    """Stiffness of one tendon [N/m]."""
    friction: float
    """Pull that one tendon loses along its way [N]: at pretension, bent by half the range."""

    @classmethod
    def of(cls, actuator: Actuator, wrist: WristParameters) -> Spools:
        """Spools with an actuator's tendons."""
        wrapped = actuator.sheath + 0.5 * math.radians(wrist.range_deg)
        return cls(actuator.tendon_stiffness, wrist.pretension * -math.expm1(-actuator.friction * wrapped))


@dataclass(frozen=True)
class HingeChain:
    """Segments of `alike` links each that bend in one plane or in two; SI units, x along the straight wrist."""

    planes: int
    segments: int
    alike: int
    length: float
    """Length of a link, from a joint to the next."""
    mass: float
    """Mass of a link."""
    hand_mass: float
    beyond: float
    """The hand's mass from the last joint."""
    gravity: tuple[float, float, float]
    stiffness: tuple[float, ...]
    """Stiffness of the first joint's hinges (P,)."""
    softening: float
    """Stiffness of each joint over that of the one before it."""
    damping: float
    """Damping of each hinge."""
    axis: float
    """Direction that each joint's first hinge bends toward, from y toward z [rad]; the second's is at a right angle."""
    tendons: tuple[Tendon, ...]
    hole: float
    """Distance of the tendons' holes from the joint, along the link."""
    tensions: tuple[float, float]
    """Least and largest tension of a tendon."""

    @property
    def links(self) -> int:
        """In all."""
        return self.segments * self.alike

    @property
    def hinges(self) -> tuple[tuple[str, tuple[float, float, float]], ...]:
        """Name and axis of each hinge of a joint (P,)."""
        if self.planes == 1:
            return (("", (0.0, 0.0, 1.0)),)
        c, s = math.cos(self.axis), math.sin(self.axis)
        return ("y", (0.0, -s + 0.0, c)), ("z", (0.0, -c, -s + 0.0))

    def order(self, k: int) -> tuple[int, ...]:
        """Order of the hinges of joint k, counted from 1, from the base."""
        hinges = tuple(range(self.planes))
        return hinges if k % 2 else hinges[::-1]

    @classmethod
    def of(cls, wrist: WristParameters, n: int, planes: int = 1, model: str = "pcc") -> HingeChain:
        """The chain of a wrist of n segments in one plane, whose motion it sees as the wrist's first, or in two.

        `model` is its plant's: of `hinges` a segment is one part of rigid links, of any other it is an arc. Raises
        UserError for a tendon that ends within a segment.
        """
        arcs = model != "hinges"
        alike = max(1, round(segments(wrist, n)[Segments._fields.index("spans")])) if arcs else 1
        part = Segments(*segments(wrist, n * alike).tolist())
        softening, first = (1.0, 1.0) if arcs else tapered(wrist, n)
        if planes == 1:
            sides = (("plus", part.tendon_offset), ("minus", -part.tendon_offset))
            tendons = tuple(Tendon(name, y, 0.0, TENDONS_PER_SIDE, n * alike) for name, y in sides)
        else:
            layout = TendonLayout.of(wrist)
            ends, places = layout.ends(wrist.discs, n) * alike, layout.cross_section.tolist()
            each = zip(places, layout.places, ends.tolist(), strict=True)
            tendons = tuple(
                Tendon(f"tendon{t}", y, z, place.multiplicity, end) for t, ((y, z), place, end) in enumerate(each, 1)
            )
        ratios = (1.0, wrist.flexion_ratio)[:planes]
        return cls(
            planes=planes,
            segments=n,
            alike=alike,
            length=part.length,
            mass=part.mass,
            hand_mass=part.hand_mass,
            beyond=0.5 * part.length + part.hand_offset,
            gravity=(part.gravity_x, part.gravity_y, wrist.gravity_flexion if planes == 2 else 0.0),
            stiffness=tuple(first * part.stiffness * ratio for ratio in ratios),
            softening=softening,
            damping=part.damping,
            axis=math.radians(wrist.stiffness_axis_deg) if planes == 2 else 0.0,
            tendons=tendons,
            hole=part.length / (6.0 * part.spans**2) if arcs else 0.5 * part.length,
            tensions=(wrist.pretension, wrist.tension_limit),
        )


def mjcf(chain: HingeChain, about: str, spools: Spools | None = None) -> str:
    """The chain as MuJoCo's XML: x along the straight wrist, y toward positive angles, or toward ulnar, z toward
    flexion; SI units.

    An actuator for each place of tendons, in one plane `plus` and `minus`, takes the tension of one tendon there [N];
    with `spools` the length that its spool has reeled in since the tendon was taut on the straight wrist [m]. In one
    plane the bending angle is the sum of the joints' angles; sensors give the tip, the last link's direction and each
    hinge. `about` says where the numbers come from.
    """
    root = ElementTree.Element("mujoco", model="wrist")
    root.append(ElementTree.Comment(f" {re.sub('-{2,}', '-', about)} "))
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    step = _FINE_STEP if spools else _STEP
    setting = {"timestep": repr(step), "integrator": "implicitfast", "gravity": _row(chain.gravity)}
    option = ElementTree.SubElement(root, "option", setting)
    ElementTree.SubElement(option, "flag", contact="disable")
    world = ElementTree.SubElement(root, "worldbody")
    ElementTree.SubElement(world, "light", pos="0.1 0 1", dir="0 0 -1")
    tendons, holes = ElementTree.SubElement(root, "tendon"), dict[str, list[str]]()
    body = world
    _link(body, 0, 0.5 * chain.length, chain, holes)
    for k in range(1, chain.links + 1):
        last = k == chain.links
        place = 0.5 * chain.length if k == 1 else chain.length
        body = ElementTree.SubElement(body, "body", name=f"link{k}", pos=f"{place!r} 0 0")
        for p in chain.order(k):
            name, axis = chain.hinges[p]
            spring = repr(chain.stiffness[p] * chain.softening ** (k - 1)), repr(chain.damping)
            hinge = {"stiffness": spring[0], "damping": spring[1], "name": f"hinge{k}{name}", "axis": _row(axis)}
            ElementTree.SubElement(body, "joint", hinge | {"type": "hinge"})
        mass, ahead = (chain.hand_mass, chain.beyond) if last else (chain.mass, chain.length)
        inertia = {"mass": repr(mass), "pos": f"{ahead!r} 0 0", "diaginertia": "1e-12 1e-12 1e-12"}
        ElementTree.SubElement(body, "inertial", inertia)
        _link(body, k, 0.5 * chain.length if last else chain.length, chain, holes)
        if last:
            ElementTree.SubElement(body, "site", name="tip", pos=f"{0.5 * chain.length!r} 0 0", size="0.003")
            ElementTree.SubElement(body, "geom", type="sphere", size="0.02", pos=f"{chain.beyond!r} 0 0", mass="0")
    alike = ElementTree.SubElement(root, "equality")
    for k in range(1, chain.links + 1):
        first = chain.alike * ((k - 1) // chain.alike) + 1
        for name, _ in chain.hinges if k != first else ():
            tie = {"polycoef": "0 1 0 0 0", "solref": _TIE, "solimp": "0.999 0.9999 0.001"}
            two = {"joint1": f"hinge{k}{name}", "joint2": f"hinge{first}{name}"}
            ElementTree.SubElement(alike, "joint", tie | two)
    actuators, sensors = ElementTree.SubElement(root, "actuator"), ElementTree.SubElement(root, "sensor")
    for tendon in chain.tendons:
        loss = {"frictionloss": repr(tendon.many * spools.friction)} if spools and spools.friction else {}
        path = ElementTree.SubElement(tendons, "spatial", {"name": tendon.name, "width": "0.0008"} | loss)
        for name in holes[tendon.name]:
            ElementTree.SubElement(path, "site", site=name)
        _motor(actuators, tendon, chain, spools)
    ElementTree.SubElement(sensors, "framepos", name="tip", objtype="site", objname="tip")
    if chain.planes == 2:
        ElementTree.SubElement(sensors, "framexaxis", name="direction", objtype="site", objname="tip")
    for k in range(1, chain.links + 1):
        for name, _ in chain.hinges:
            ElementTree.SubElement(sensors, "jointpos", name=f"angle{k}{name}", joint=f"hinge{k}{name}")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _row(values: tuple[float, ...]) -> str:
    """Numbers as MuJoCo reads them; whole ones without a point."""
    return " ".join(repr(int(value)) if value == int(value) else repr(value) for value in values)


def _motor(actuators: ElementTree.Element, tendon: Tendon, chain: HingeChain, spools: Spools | None) -> None:
    """An actuator that pulls: a tension, or the stretch of a tendon behind its spool."""
    named = {"name": tendon.name, "tendon": tendon.name, "gear": repr(-float(tendon.many))}
    low, high = chain.tensions
    if spools is None:
        ElementTree.SubElement(actuators, "motor", named | {"ctrlrange": f"{low!r} {high!r}"})
        return
    taut, k = (tendon.joints - 1) * chain.length + 2.0 * chain.hole, spools.stiffness
    law = {"gaintype": "fixed", "biastype": "affine", "gainprm": repr(k)}
    law |= {"biasprm": f"{-k * taut!r} {-k / tendon.many!r} 0", "forcerange": f"0 {_NO_LIMIT!r}"}
    ElementTree.SubElement(actuators, "general", named | law)


def _link(body: ElementTree.Element, k: int, length: float, chain: HingeChain, holes: dict[str, list[str]]) -> None:
    """Draw link k and its tendons' holes: after the joint before it, and before the next one."""
    ElementTree.SubElement(
        body,
        "geom",
        type="capsule",
        size="0.003",
        fromto=f"0 0 0 {length!r} 0 0",
        mass="0",
        contype="0",
        conaffinity="0",
    )
    rim = _RIM * max(math.hypot(tendon.y, tendon.z) for tendon in chain.tendons)
    ElementTree.SubElement(
        body, "geom", type="cylinder", size=f"{rim!r} 0.0015", pos=f"{0.5 * length if k else 0.0!r} 0 0",
        zaxis="1 0 0", mass="0", contype="0", conaffinity="0",
    )  # fmt: skip
    places = [("a", k, chain.hole)] * (k > 0) + [("b", k + 1, length - chain.hole)] * (k < chain.links)
    for tendon in chain.tendons:
        for end, joint, x in places:
            if joint <= tendon.joints:
                name = f"{tendon.name}{'_' if chain.planes == 2 else ''}{k}{end}"
                place = f"{x!r} {tendon.y!r} {_row((tendon.z,))}"
                ElementTree.SubElement(body, "site", name=name, pos=place, size="0.001")
                holes.setdefault(tendon.name, []).append(name)


_MATLAB = """\
function [acceleration, tip, bend] = wrist_chain(q, rate, tension)
%WRIST_CHAIN  Equations of motion of a tendon-driven wrist as a chain of rigid links in {in_planes}; SI units.
%   {about}
%   [acceleration, tip, bend] = WRIST_CHAIN(q, rate, tension) gives the segments' accelerations [rad/s^2], the tip
%   [m], x along the straight wrist, and the bend [rad], {rows}, of the segments' angles q [rad] and rates
%   [rad/s], {size} x 1 each, {one_by_one}and of the tensions {of_tendons}, {low!r} to {high!r} N.
%   For ode15s: @(t, y) [y({after}:end); wrist_chain(y(1:{size}), y({after}:end), tension)]
n = {links};
alike = {alike};         % joints of a segment, which bend alike
len = {length!r};        % [m] of a link, from a joint to the next
mass = {mass!r};         % [kg] at each joint
hand = {hand_mass!r};    % [kg]
beyond = {beyond!r};     % [m] of the hand's mass from the last joint
gravity = [{gravity}]';  % [m/s^2] along and across the straight wrist
axes_ = [{axes}];  % of a joint's hinges, in columns
stiffness = [{stiffness}]' * {softening!r} .^ (0:n - 1);  % [N m/rad] of each hinge, joint by joint
damping = {damping!r};   % [N m s/rad] of each hinge
places = [{places}];  % [m] of the tendons across, a row each
count = [{count}];  % tendons at each place
joints = [{joints}];  % joints that they run past
hole = {hole!r};         % [m] of their holes from a joint
planes = size(axes_, 2);
spread = kron(kron(eye(n / alike), ones(alike, 1) / alike), eye(planes));
q = spread * q(:);
rate = spread * rate(:);
turned = eye(3);
place = [len / 2; 0; 0];
hinge = zeros(3, planes * n);
base = zeros(3, planes * n);
spin = zeros(3, 1);
spin_rate = zeros(3, 1);
drift = zeros(3, 1);
inertia = zeros(planes * n);
torque = -reshape(stiffness, [], 1) .* q - damping * rate;
for k = 1:n
    order = 1:planes;
    if mod(k, 2) == 0
        order = fliplr(order);
    end
    before = turned;
    for p = order
        i = planes * (k - 1) + p;
        hinge(:, i) = turned * axes_(:, p);
        base(:, i) = place;
        spin_rate = spin_rate + cross(spin, hinge(:, i)) * rate(i);
        spin = spin + hinge(:, i) * rate(i);
        a = axes_(:, p);
        skew = [0, -a(3), a(2); a(3), 0, -a(1); -a(2), a(1), 0];
        turned = turned * (eye(3) + sin(q(i)) * skew + (1 - cos(q(i))) * skew * skew);
    end
    for t = find(k <= joints)
        across = [0; places(t, :)'];
        ahead = turned * (across + [hole; 0; 0]);
        way = ahead - before * (across - [hole; 0; 0]);
        for i = planes * (k - 1) + (1:planes)
            pull = count(t) * tension(t) * way / norm(way);
            torque(i) = torque(i) - dot(pull, cross(hinge(:, i), ahead));
        end
    end
    weight = mass;
    ahead = turned * [len; 0; 0];
    if k == n
        weight = hand;
        ahead = turned * [beyond; 0; 0];
    end
    drift = drift + cross(spin_rate, ahead) + cross(spin, cross(spin, ahead));
    moved = zeros(3, planes * n);
    for i = 1:planes * k
        moved(:, i) = cross(hinge(:, i), place + ahead - base(:, i));
    end
    inertia = inertia + weight * (moved' * moved);
    torque = torque + weight * moved' * (gravity - drift);
    if k < n
        place = place + ahead;
    end
end
acceleration = (spread' * inertia * spread) \\ (spread' * torque);
tip = place + turned * [len / 2; 0; 0];
tip = tip(1:planes + 1);
aside = turned(2:planes + 1, 1);
angle = atan2(norm(aside), turned(1, 1));
bend = aside * (angle / max(norm(aside), realmin));
end
"""


def matlab(chain: HingeChain, about: str) -> str:
    """The chain's equations of motion as a function of base MATLAB (or Octave), without toolboxes."""
    low, high = chain.tensions
    planar, size = chain.planes == 1, chain.segments * chain.planes

    def listed(values: list[str], between: str = ", ") -> str:
        return between.join(values)

    axes = [listed([repr(axis[row]) for _, axis in chain.hinges]) for row in range(3)]
    return _MATLAB.format(
        about=about, low=low, high=high, size=size, after=size + 1, links=chain.links, alike=chain.alike,
        length=chain.length, mass=chain.mass, hand_mass=chain.hand_mass, beyond=chain.beyond, damping=chain.damping,
        softening=chain.softening, hole=chain.hole, gravity=listed([repr(value) for value in chain.gravity]),
        axes=listed(axes, "; "), stiffness=listed([repr(value) for value in chain.stiffness]),
        places=listed([f"{tendon.y!r}, {tendon.z!r}" for tendon in chain.tendons], "; "),
        count=listed([str(tendon.many) for tendon in chain.tendons]),
        joints=listed([str(tendon.joints) for tendon in chain.tendons]),
        in_planes="one plane" if planar else "two planes",
        rows="a number" if planar else "[ulnar; flexion]",
        one_by_one="" if planar else "[ulnar; flexion] of each in turn, ",
        of_tendons="[plus; minus] of one tendon of each side" if planar else "of one tendon at each place",
    )  # fmt: skip
