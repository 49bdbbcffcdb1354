"""What can be made to go wrong on the emulated rig, and when."""

from __future__ import annotations

from typing import Literal

from wristctl.config.section import Section, choice, quantity

FAULTS = {
    "port-lost": "the cable is pulled: the port is gone for good",
    "board-reset": "the board restarts once: drives off, positions lost",
    "frames-dropped": "no frame arrives",
    "marker-covered": "something covers the marker on the last disc",
    "markers-swapped": "the two markers change places",
    "camera-frozen": "frames keep coming, with new times, but show what the last one before showed",
    "host-silent": "nothing that the host sends reaches the board",
    "controller-exception": "the controller raises an exception",
    "model-nan": "the model gives NaN",
    "disk-full": "nothing can be written to the run",
    "direction-flipped": "the motor turns the other way",
    "direction-stuck": "the motor reels in whatever it is told",
    "motor-stalled": "the rotor stands; its drive goes on counting",
    "drive-off": "the drive has no power; its tendon is let go",
    "supply-off": "no drive has power",
    "tendon-detached": "the tendon is off its pulley",
    "tendon-slipped": "the tendon slips on its pulley, once, paying out `size` mm",
    "marker-turned": "the tip's marker has slipped on its disc by `size` deg",
    "camera-repeats": "the camera shows its last `size` pictures again and again",
    "camera-frozen-clock": "as camera-frozen, but for one pixel that changes",
    "frames-thinned": "one frame of `size` arrives",
    "pictures-late": "pictures are `size` s older than their times say",
    "stamps-shifted": "frames are dated `size` s later than they are",
    "stamps-stuck": "the time of the frames stands",
    "camera-lost": "the camera is gone for good",
    "picture-dark": "there is `size` of the light",
    "picture-bright": "there is `size` times the light, and a haze",
    "picture-blurred": "the picture is blurred by `size` px",
    "picture-smeared": "the picture is smeared over `size` px",
    "picture-mirrored": "the picture is mirrored",
    "picture-turned": "the camera is turned by `size` deg about its axis",
    "picture-shifted": "the camera is turned aside by `size` px",
    "picture-other": "the camera sees something else",
    "marker-twice": "another marker of id `size` comes into view",
    "usb-latency": "answers are handed over every `size` ms only",
    "answers-late": "each answer comes `size` ms late",
    "answers-held": "answers are held back once, for `size` ms",
    "host-pause": "the whole host stands still once, for `size` ms",
    "bytes-garbled": "each byte loses a bit with probability `size`",
    "estop-pressed": "somebody presses the emergency stop button",
}
"""Every kind of fault that can be injected: controller-exception, model-nan and disk-full are the control loop's, the
others the bench's; from usb-latency on they are in virtual time only."""

FaultKind = Literal[
    "port-lost", "board-reset", "frames-dropped", "marker-covered", "markers-swapped", "camera-frozen", "host-silent",
    "controller-exception", "model-nan", "disk-full", "direction-flipped", "direction-stuck", "motor-stalled",
    "drive-off", "supply-off", "tendon-detached", "tendon-slipped", "marker-turned", "camera-repeats",
    "camera-frozen-clock", "frames-thinned", "pictures-late", "stamps-shifted", "stamps-stuck", "camera-lost",
    "picture-dark", "picture-bright", "picture-blurred", "picture-smeared", "picture-mirrored", "picture-turned",
    "picture-shifted", "picture-other", "marker-twice", "usb-latency", "answers-late", "answers-held", "host-pause",
    "bytes-garbled", "estop-pressed",
]  # fmt: skip


class InjectedFault(Section):
    """Something that goes wrong."""

    kind: FaultKind = choice("port-lost", "; ".join(f"{kind}: {what}" for kind, what in FAULTS.items()))
    at: float = quantity(1.0, "s", "when", ge=0)
    since: Literal["trial", "first trial", "power-on"] = choice(
        "trial", "what `at` counts from: the start of each trial's motion, of the first one's, or the board's power-on"
    )
    duration: float | None = quantity(None, "s", "how long it lasts; null: for good", gt=0)
    axis: int = choice(0, "whose motor or tendon", ge=0, lt=4)
    size: float = quantity(1.0, "", "how much, in the unit that the kind says")
