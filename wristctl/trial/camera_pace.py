"""Pace of a camera: rate, age and faults of its pictures, also in words."""

import math
from collections import Counter, deque

import numpy as np

from wristctl.trial.rig_words import REPEATS
from wristctl.vision.camera import CameraError
from wristctl.vision.marker import Sighting, SightingVerdict

_REMEMBERED = 90
_ONLY = "the camera"
# Gap between two pictures from which nobody has looked [s]: a trial stops far sooner where a camera gives none.
_PAUSE = 2.0
# Relative scatter of the time between two pictures that is worth a word.
_UNEVEN = 0.3

# Advice to look at pictures by the check of a rig, after what is to be looked at.
BY_CHECK = ": wristctl hw check --rig"
_LIGHT = f"and the camera's light and focus{BY_CHECK}"
# Advice about pictures that cannot be used, by their verdict.
FIX = {
    SightingVerdict.NO_TIP: f"see that nothing covers the tip's marker, {_LIGHT}",
    SightingVerdict.NO_BASE: f"see that nothing covers the clamp's marker, {_LIGHT}",
    SightingVerdict.DICTIONARY: "print the markers of wristctl hw drawings: ArUco, DICT_4X4_50",
    SightingVerdict.TWICE: "take away or cover whatever else shows a marker of the same id",
    SightingVerdict.SHAPE: "uncover the tip's marker whole and make it flat; a shorter exposure where it is smeared",
    SightingVerdict.BASE_MOVED: "fasten camera and clamp, and home again; wristctl hw calibrate camera",
    SightingVerdict.SWAPPED: "markers.base belongs on the clamp, markers.tip on the last disc; or both are upside down",
    SightingVerdict.JUMP: "see that the tip's marker sits fast on its disc, and that no other one is taken for it",
    SightingVerdict.FROZEN: REPEATS,
    SightingVerdict.STAMP: "the camera's driver gives times that cannot be: plug it in again, another USB port",
}


class CameraPace:
    """The pictures of the last seconds; times are of the loop's clock [s]. `name` is what the camera is called."""

    def __init__(self, name: str = _ONLY) -> None:
        self.name, self.used = name, -math.inf
        """When its newest usable picture came."""
        self._seen: deque[Sighting] = deque(maxlen=_REMEMBERED)
        self.verdicts: Counter[SightingVerdict] = Counter()
        """Count of all pictures by verdict."""

    def add(self, sighting: Sighting) -> None:
        """The next picture."""
        self._seen.append(sighting)
        if sighting.verdict is SightingVerdict.OK:
            self.used = sighting.came
        self.verdicts[sighting.verdict] += 1

    @property
    def whose(self) -> str:
        """The camera after what is its, in words; nothing where it is the only one."""
        return "" if self.name == _ONLY else f" of {self.name}"

    @property
    def rate(self) -> float:
        """Pictures that came, per second; nan where fewer than two did. Pauses in which nobody looked do not count."""
        gaps = np.diff([sighting.came for sighting in self._seen])
        looked = gaps[gaps < _PAUSE]
        return float(1.0 / looked.mean()) if looked.sum() > 0.0 else float("nan")

    @property
    def latency(self) -> float:
        """Median age of a picture when it comes, by its stamp [s]: no more is known of it here."""
        return float(np.median([frame.came - frame.time for frame in self._seen])) if self._seen else float("nan")

    @property
    def jitter(self) -> float:
        """Scatter of the time between two pictures that follow each other [s], a standard deviation if it is normal."""
        gaps = [
            after.came - before.came
            for before, after in zip(self._seen, list(self._seen)[1:], strict=False)
            if after.number - before.number == 1
        ]
        return 1.4826 * float(np.median(np.abs(np.subtract(gaps, np.median(gaps))))) if gaps else float("nan")

    def oldest(self, lost: int = 1) -> float:
        """Age [s] of the newest angle just before the next one comes, where so many pictures between them are lost."""
        return self.latency + (1 + lost) / self.rate

    def said(self) -> str:
        """In words."""
        if len(self._seen) < 2:
            return f"{self.name} gives no pictures"
        old = f", {1e3 * self.latency:.0f} ms old when they come" if self.latency > 1e-3 else ""
        uneven = f", unevenly (+-{1e3 * self.jitter:.0f} ms)" if self.jitter * self.rate > _UNEVEN else ""
        return f"{self.name} gives {self.rate:.3g} pictures/s{old}{uneven}"

    def summary(self) -> str:
        """In words, with what could not be used of all pictures."""
        of = sum(self.verdicts.values())
        odd = [f"{count} {verdict}" for verdict, count in self.verdicts.most_common() if verdict != SightingVerdict.OK]
        unusable = f"; of {of} pictures {', '.join(odd)}" if odd else ""
        told = f"{self.said()}{unusable}."
        return told[0].upper() + told[1:]

    def missing(self, now: float, stale: float) -> tuple[str, str]:
        """Why there has been no angle for `stale` seconds, and what to do about it."""
        if not self._seen or now - self._seen[-1].came > stale:
            until_then = f"; until then {self.said().removeprefix('the ')}" if len(self._seen) > 1 else ""
            return (
                f"no picture{self.whose} has come{until_then}",
                "see the camera's cable, and that no other program uses it",
            )
        newest = self._seen[-1].verdict
        if newest is not SightingVerdict.OK:
            return f"newest frame{self.whose}: {newest}", FIX[newest]
        return f"newest frame{self.whose}: {newest}; {self.said()}", self._faster()

    def fits(self, stale: float, hidden: float = 0.0) -> None:
        """Raises CameraError for a camera whose pictures are too few, or too old when they come, for this limit [s].

        `hidden` is an age [s] that their time stamps do not tell of.
        """
        if (oldest := self.oldest() + hidden) > stale:
            problem = (
                f"{self.said()}: where one is lost the angle is {1e3 * oldest:.0f} ms old before the next, beyond "
                f"safety.stale ({1e3 * stale:.0f} ms)"
            )
            raise CameraError(problem, "camera", self._faster(hidden))

    def _faster(self, hidden: float = 0.0) -> str:
        return (
            "a faster mode of the camera (device.fourcc: MJPG, device.frame_rate, a shorter device.exposure), or "
            f"safety.stale of {stale_for(self.oldest() + hidden):g} s at least, with a slower reference"
        )


def stale_for(age: float) -> float:
    """`safety.stale` [s] that bears an angle of this age [s]: the next twentieth of a second."""
    return math.ceil(20.0 * age) / 20.0


class CameraPaces:
    """The pace of a rig's only camera, or of each of its two."""

    def __init__(self) -> None:
        self.by_camera = [CameraPace()]
        """The pace of each camera."""

    def expect(self, cameras: int) -> None:
        """Know how many cameras there are, before the first picture of two."""
        if cameras > len(self.by_camera):
            self.by_camera = [CameraPace(f"camera {number + 1}") for number in range(cameras)]

    def add(self, sighting: Sighting) -> None:
        """The next picture, of the camera that looks at its plane."""
        self.by_camera[sighting.plane].add(sighting)

    def summary(self) -> str:
        """In words, with what could not be used of all pictures."""
        return " ".join(pace.summary() for pace in self.by_camera)

    def missing(self, now: float, stale: float) -> tuple[str, str]:
        """Why one camera, that with the oldest angle, has given none for `stale` seconds, and what to do about it."""
        return min(self.by_camera, key=lambda pace: pace.used).missing(now, stale)

    def fits(self, stale: float) -> None:
        """Raises CameraError where a camera's pictures are too few, or too old when they come, for this limit [s]."""
        for pace in self.by_camera:
            pace.fits(stale)
