"""The shutter of the bench's camera: which frames it takes, what they show, and when they arrive."""

import math
from typing import NamedTuple

import cv2
import numpy as np

from wristctl.arrays import Array
from wristctl.bench.bench_wrist import BenchWrist
from wristctl.bench.faults import Faults
from wristctl.config.bench import FaultKind, RenderedCamera
from wristctl.seeds import Entropy
from wristctl.vision.camera import Frame, Image
from wristctl.vision.detector import print_of
from wristctl.vision.scene import Scene

PICTURE_FAULTS: tuple[FaultKind, ...] = (
    "camera-frozen-clock", "picture-dark", "picture-bright", "picture-blurred", "picture-smeared", "picture-mirrored",
    "picture-turned", "picture-shifted", "picture-other", "marker-twice",
)  # fmt: skip
_HAZE, _SIDE, _CORNER = 60.0, 64, 20


def spoiled(image: Image, kind: FaultKind, size: float, number: int, rng: np.random.Generator) -> Image:
    """The picture (height, width) of frame `number` under a fault of this kind."""
    height, width = image.shape
    if kind in ("picture-dark", "picture-bright"):
        haze = _HAZE if kind == "picture-bright" and size > 2.0 else 0.0
        lit: Image = np.clip(size * image.astype(np.float32) + haze, 0, 255).astype(np.uint8)
        return lit
    if kind == "picture-blurred":
        return cv2.GaussianBlur(image, (0, 0), size).astype(np.uint8, copy=False)
    if kind == "picture-smeared":
        return cv2.blur(image, (round(size), 1)).astype(np.uint8, copy=False)
    if kind == "picture-mirrored":
        return cv2.flip(image, 1).astype(np.uint8, copy=False)
    if kind == "picture-turned":
        turn = cv2.getRotationMatrix2D((0.5 * width, 0.5 * height), size, 1.0)
        return cv2.warpAffine(image, turn, (width, height), borderMode=cv2.BORDER_REPLICATE).astype(np.uint8)
    if kind == "picture-shifted":
        rolled: Image = np.roll(image, round(size), axis=1)
        return rolled
    if kind == "picture-other":
        return rng.integers(0, 255, image.shape, np.uint8)
    image = image.copy()
    if kind == "marker-twice":
        part = cv2.resize(print_of(round(size)), (_SIDE, _SIDE), interpolation=cv2.INTER_NEAREST)
        image[_CORNER : _CORNER + _SIDE, _CORNER : _CORNER + _SIDE] = part
    else:
        image[0, 0] = number % 256
    return image


class Exposure(NamedTuple):
    """All that a frame's picture is made of; what a frozen camera shows is another frame's."""

    number: int
    time: float
    """middle of the exposure [s]"""
    shown: int
    theta: Array
    """(k, q) coordinates of k parts of the exposure [rad]"""
    covered: bool
    swapped: bool
    noise: Entropy
    """entropy of the `shown` frame's random stream: the first number decides about its loss, the others make noise"""
    across: float = 0.0
    """bend across the plane, away from the camera [rad]"""
    turned: float = 0.0
    """slip of the tip's marker [rad]"""
    spoiled: tuple[tuple[FaultKind, float], ...] = ()
    """kinds and sizes of what spoils the picture"""
    late: float = 0.0
    """how much later than by the camera's delay it arrives [s]"""


def picture(exposure: Exposure, painter: Scene) -> Frame:
    """Draw it; of one `shown` frame always the same."""
    rng = np.random.default_rng(exposure.noise)
    rng.random()
    image = painter.render(
        exposure.theta, rng, exposure.covered, exposure.swapped, exposure.across, exposure.turned
    )  # fmt: skip
    for kind, size in exposure.spoiled:
        image = spoiled(image, kind, size, exposure.number, rng)
    return Frame(image, exposure.time, exposure.number)


# Turn of the last disc (about half a pixel of its marker's way) for which a part of the exposure is drawn, and how many
# are drawn at most; moments whose mean a part shows.
_SMEAR, _MOST_INSTANTS, _WITHIN = np.deg2rad(0.25), 8, 8


class Shutter:
    """Takes frame number k at k/frame_rate on the board's clock. Each frame has a random stream of its own.

    From a trial's start on frames count anew, in the trial's own stream: trials of the same scenario and repetition
    meet the same noise, whatever was done before them.
    """

    def __init__(self, settings: RenderedCamera, faults: Faults, wrist: BenchWrist, stream: Entropy) -> None:
        self._settings, self._faults, self._wrist = settings, faults, wrist
        self._streams = [(0, stream)]  # the first frame of each, and whose it is

    def begin(self, start: float, stream: Entropy) -> None:
        """Frames from `start` [s] on belong to this stream."""
        first = start * self._settings.frame_rate - self._settings.phase
        self._streams.append((math.ceil(first - 1e-9), stream))

    @property
    def delay(self) -> float:
        """From the middle of an exposure to the frame's arrival [s]."""
        return self._settings.delay_frames / self._settings.frame_rate

    def newest(self, delay: float) -> int:
        """The newest frame whose exposure is over, and its middle `delay` s past; negative where there is none."""
        past = max(delay, 0.5 * self._settings.exposure)
        return math.floor((self._wrist.time - past) * self._settings.frame_rate - self._settings.phase + 1e-9)

    def late(self, number: int) -> float:
        """How much later than by its delay this frame arrives [s]."""
        jitter = self._settings.jitter
        return jitter and jitter * float(np.random.default_rng((*self._noise(number), 0)).random())

    def has_arrived(self, number: int) -> bool:
        """Whether a frame whose delay is over is there by now."""
        return self._time(number) + self.delay + self.late(number) <= self._wrist.time + 1e-9

    def arrives(self, number: int) -> bool:
        """Whether this frame gets through."""
        dropped = np.random.default_rng(self._noise(number)).random() < self._settings.dropped
        faults, time = self._faults, self._time(number)
        thinned = any(number % round(fault.size) for fault in faults.active(("frames-thinned",), time))
        return not (dropped or thinned or faults.on("frames-dropped", time))

    def expose(self, number: int) -> Exposure:
        """Exposure of a frame; it is over, and not longer ago than the wrist remembers."""
        faults, time = self._faults, self._time(number)
        shown = self._shown(number, time)
        late = sum(fault.size for fault in faults.active(("pictures-late",), time))
        middle = self._time(shown) - late
        half = 0.5 * self._settings.exposure
        ends = self._wrist.angles(np.array([middle - half, middle + half]))
        turned = self._wrist.turned(ends)
        count = min(_MOST_INSTANTS, max(1, math.ceil(turned / _SMEAR)))
        moments = middle + half * np.linspace(-1.0, 1.0, 2 * count * _WITHIN + 1)[1::2]
        parts = self._wrist.angles(moments).reshape(count, _WITHIN, -1).mean(axis=1)
        covered, swapped = (faults.on(kind, middle) for kind in ("marker-covered", "markers-swapped"))
        turned = sum(fault.size for fault in faults.active(("marker-turned",), middle))
        turned += sum(fault.size * (middle - faults.begun(fault)) for fault in faults.active(("marker-peels",), middle))
        spoiled = tuple((fault.kind, fault.size) for fault in faults.active(PICTURE_FAULTS, time))
        across = self._wrist.across(middle)
        stamp = self._stamp(time)
        return Exposure(
            number, stamp, shown, parts, covered, swapped, self._noise(shown), across, math.radians(turned), spoiled,
            self.late(number),
        )  # fmt: skip

    def _shown(self, number: int, time: float) -> int:
        shown = [number]
        for fault in self._faults.active(("camera-frozen", "camera-frozen-clock", "camera-repeats"), time):
            first = math.floor(self._faults.begun(fault) * self._settings.frame_rate - self._settings.phase)
            ring = round(fault.size) if fault.kind == "camera-repeats" else 1
            shown.append(first - ring + 1 + (number - first - 1) % ring)
        return min(shown)

    def _stamp(self, time: float) -> float:
        stuck = self._faults.since("stamps-stuck", time)
        return (time if stuck is None else stuck) + sum(
            fault.size for fault in self._faults.active(("stamps-shifted",), time)
        )

    def _noise(self, number: int) -> Entropy:
        first, stream = next(begun for begun in reversed(self._streams) if begun[0] <= number)
        return *stream, number - first

    def _time(self, number: int) -> float:
        return (number + self._settings.phase) / self._settings.frame_rate
