"""The wrist as a chain of rigid links for other simulators: MuJoCo's model, and equations of motion for MATLAB.

Between two discs there are two straight halves with a hinge, spring and damper between them; masses sit at the hinges,
the hand's at the end. Hinges of one segment bend alike. Tendons pass two holes a hinge, at +-l/(6 g^2) from it, l a
link's length and g the straight pieces of tendon on it: so far from it their length falls with the bend as that of the
arc's tendons, to third order. (Through holes in the discs they would squeeze the chain three times as much.)
"""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from xml.etree import ElementTree

from wristctl.config.wrist import WristParameters
from wristctl.wrist.segments import Segments, segments
from wristctl.wrist.tendons import TENDONS_PER_SIDE

_STEP = 1e-3
_RIM = 1.25
# Time constant and damping of the tie between hinges that bend alike: two steps, the fastest that MuJoCo holds stable.
_TIE = "0.002 1"
_SIDES = (("plus", 1.0), ("minus", -1.0))


@dataclass(frozen=True)
class HingeChain:
    """Segments of `alike` links each in a bending plane; SI units."""

    segments: int
    alike: int
    length: float
    """Length of a link, from a hinge to the next."""
    mass: float
    """Mass of a link."""
    hand_mass: float
    beyond: float
    """The hand's mass from the last hinge."""
    gravity: tuple[float, float]
    stiffness: float
    """Stiffness of each hinge."""
    damping: float
    offset: float
    hole: float
    """Distance of the tendons' holes from the hinge, along the link."""
    tensions: tuple[float, float]
    """Least and largest tension of a tendon."""

    @property
    def links(self) -> int:
        """In all."""
        return self.segments * self.alike

    @classmethod
    def of(cls, wrist: WristParameters, n: int) -> HingeChain:
        """The chain of a wrist of n segments as its motion in one bending plane sees it."""
        alike = max(1, round(segments(wrist, n)[Segments._fields.index("spans")]))
        part = Segments(*segments(wrist, n * alike).tolist())
        return cls(
            segments=n,
            alike=alike,
            length=part.length,
            mass=part.mass,
            hand_mass=part.hand_mass,
            beyond=0.5 * part.length + part.hand_offset,
            gravity=(part.gravity_x, part.gravity_y),
            stiffness=part.stiffness,
            damping=part.damping,
            offset=part.tendon_offset,
            hole=part.length / (6.0 * part.spans**2),
            tensions=(wrist.pretension, wrist.tension_limit),
        )


def mjcf(chain: HingeChain, about: str) -> str:
    """The chain as MuJoCo's XML: x along the straight wrist, y toward positive angles, SI units.

    Two actuators, `plus` and `minus`, take the tension of one tendon of their side [N]. The bending angle is the sum of
    the joints' angles; sensors give the tip and each joint. `about` says where the numbers come from.
    """
    root = ElementTree.Element("mujoco", model="wrist")
    root.append(ElementTree.Comment(f" {re.sub('-{2,}', '-', about)} "))
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    gravity = f"{chain.gravity[0]!r} {chain.gravity[1]!r} 0"
    option = ElementTree.SubElement(root, "option", timestep=repr(_STEP), integrator="implicitfast", gravity=gravity)
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
        spring = {"stiffness": repr(chain.stiffness), "damping": repr(chain.damping)}
        ElementTree.SubElement(body, "joint", spring | {"name": f"hinge{k}", "type": "hinge", "axis": "0 0 1"})
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
        if k != first:
            tie = {"polycoef": "0 1 0 0 0", "solref": _TIE, "solimp": "0.999 0.9999 0.001"}
            ElementTree.SubElement(alike, "joint", tie | {"joint1": f"hinge{k}", "joint2": f"hinge{first}"})
    for side, places in holes.items():
        path = ElementTree.SubElement(tendons, "spatial", name=side, width="0.0008")
        for name in places:
            ElementTree.SubElement(path, "site", site=name)
    actuators, sensors = ElementTree.SubElement(root, "actuator"), ElementTree.SubElement(root, "sensor")
    low, high = chain.tensions
    for side, _ in _SIDES:
        limits = {"ctrlrange": f"{low!r} {high!r}", "gear": repr(-float(TENDONS_PER_SIDE))}
        ElementTree.SubElement(actuators, "motor", limits | {"name": side, "tendon": side})
    ElementTree.SubElement(sensors, "framepos", name="tip", objtype="site", objname="tip")
    for k in range(1, chain.links + 1):
        ElementTree.SubElement(sensors, "jointpos", name=f"angle{k}", joint=f"hinge{k}")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _link(body: ElementTree.Element, k: int, length: float, chain: HingeChain, holes: dict[str, list[str]]) -> None:
    """Draw link k and its tendons' holes: after the hinge before it, and before the next one."""
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
    half = str(_RIM * chain.offset)
    ElementTree.SubElement(
        body, "geom", type="cylinder", size=f"{half} 0.0015", pos=f"{0.5 * length if k else 0.0!r} 0 0",
        zaxis="1 0 0", mass="0", contype="0", conaffinity="0",
    )  # fmt: skip
    places = [(0, chain.hole)] * (k > 0) + [(1, length - chain.hole)] * (k < chain.links)
    for side, sign in _SIDES:
        for end, x in places:
            name = f"{side}{k}{'ab'[end]}"
            ElementTree.SubElement(body, "site", name=name, pos=f"{x!r} {sign * chain.offset!r} 0", size="0.001")
            holes.setdefault(side, []).append(name)


_MATLAB = """\
function [acceleration, tip, angle] = wrist_chain(q, rate, tension)
%WRIST_CHAIN  Equations of motion of a tendon-driven wrist as a chain of rigid links in one plane; SI units.
%   {about}
%   [acceleration, tip, angle] = WRIST_CHAIN(q, rate, tension) gives the segments' accelerations [rad/s^2], the tip
%   [x; y] [m], x along the straight wrist, and the bending angle [rad], of the segments' angles q [rad] and rates
%   [rad/s], {segments} x 1 each, and of the tensions [plus; minus] of one tendon of each side, {low!r} to {high!r} N.
%   For ode15s: @(t, y) [y({after}:end); wrist_chain(y(1:{segments}), y({after}:end), tension)]
n = {links};
alike = {alike};         % hinges of a segment, which bend alike
len = {length!r};        % [m] of a link, from a hinge to the next
mass = {mass!r};         % [kg] at each hinge
hand = {hand_mass!r};    % [kg]
beyond = {beyond!r};     % [m] of the hand's mass from the last hinge
gravity = complex({gx!r}, {gy!r});  % [m/s^2] along and across the straight wrist
stiffness = {stiffness!r};  % [N m/rad] of each hinge
damping = {damping!r};   % [N m s/rad] of each hinge
offset = {offset!r};     % [m] of the tendons from the middle
hole = {hole!r};         % [m] of their holes from the hinge
spread = kron(eye(n / alike), ones(alike, 1) / alike);
q = spread * q(:);
rate = spread * rate(:);
along = exp(1i * cumsum(q));
turning = cumsum(rate);
reach = tril(len * ones(n));
reach(n, n) = beyond;
masses = [mass * ones(n - 1, 1); hand];
moved = zeros(n, n);
for k = 1:n
    moved(:, k) = 1i * reach(:, k:n) * along(k:n);
end
inertia = real(moved' * (masses .* moved));
centripetal = -reach * (turning .^ 2 .* along);
bending = offset * cos(q / 2);
squeezing = hole * sin(q / 2);
pull = {per_side} * tension(:);
torque = pull(1) * (squeezing + bending) + pull(2) * (squeezing - bending) - stiffness * q - damping * rate;
load = real(moved' * (masses .* (gravity - centripetal)));
acceleration = (spread' * inertia * spread) \\ (spread' * (torque + load));
reach(n, n) = len / 2;
place = len / 2 + reach(n, :) * along;
tip = [real(place); imag(place)];
angle = sum(q);
end
"""


def matlab(chain: HingeChain, about: str) -> str:
    """The chain's equations of motion as a function of base MATLAB (or Octave), without toolboxes."""
    gx, gy = chain.gravity
    low, high = chain.tensions
    fields = asdict(chain)
    more = {"after": chain.segments + 1, "links": chain.links, "per_side": TENDONS_PER_SIDE, "about": about}
    return _MATLAB.format(**fields, gx=gx, gy=gy, low=low, high=high, **more)
