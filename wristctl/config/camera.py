"""Vision: markers, gates, the rendered scene, calibration, recordings."""

from typing import Literal, Self

from pydantic import model_validator

from wristctl.config.section import Section, choice, quantity


class Markers(Section):
    """The two square markers (dictionary 4x4_50), top edge toward the hand, facing the camera."""

    base: int = choice(0, "id of the marker on the clamp", ge=0, lt=50)
    tip: int = choice(1, "id of the marker on the last disc", ge=0, lt=50)
    side: float = quantity(0.020, "m", "side of the black square", "assumed", gt=0)
    base_at: float = quantity(
        -0.022,
        "m",
        "middle of the base's marker from the first disc, along the straight wrist",
        "assumed: on the clamp",
    )
    distance: float = quantity(
        0.25, "m", "from the lens to the markers; scales the bend across the plane", "assumed", gt=0.02
    )
    positive: Literal["right", "left"] = choice(
        "right", "side of the picture, hand up, toward which the angle counts positive"
    )

    @model_validator(mode="after")
    def _two_markers(self) -> Self:
        if self.base == self.tip:
            raise ValueError(f"base and tip need different ids, both are {self.tip}")
        return self


class Gates(Section):
    """Gates that a sighting must pass before its angle is used."""

    rate: float = quantity(21.0, "rad/s", "largest rate from one used frame to the next",
                           "20,000 steps/s of tendon over its lever", gt=0)  # fmt: skip
    margin_deg: float = quantity(1.0, "deg", "jump allowed beside that rate: noise", "ten standard deviations", ge=0)
    side_ratio: float = quantity(1.12, "", "longest side over shortest, rectified", "measured: a hidden corner", gt=1)
    corner_deg: float = quantity(6.0, "deg", "largest deviation of a corner from 90 deg", "as side_ratio", gt=0)
    base_memory: float = quantity(0.5, "s", "the clamped base is averaged, and believed unseen", "assumed", gt=0)
    base_shift: float = quantity(0.1, "", "displacement of the base that is refused, in sides", "assumed", gt=0)


class SceneSettings(Section):
    """The rendered camera and what it looks at."""

    width: int = quantity(640, "px", "picture width", ge=160)
    height: int = quantity(480, "px", "picture height", ge=120)
    field_deg: float = quantity(60.0, "deg", "horizontal field of view", "assumed: a webcam", gt=5, lt=150)
    distance: float = quantity(0.28, "m", "from the lens to the bending plane", "assumed: markers of 44 px", gt=0.05)
    height_above: float = quantity(0.060, "m", "of the point looked at, beyond the base disc", "assumed")
    tilt_deg: float = quantity(0.0, "deg", "camera above (+) the level of that point", "assumed", gt=-60, lt=60)
    pan_deg: float = quantity(0.0, "deg", "camera beside that point, + toward theta > 0", "assumed", gt=-60, lt=60)
    roll_deg: float = quantity(0.0, "deg", "camera turned about its axis", "assumed", ge=-180, le=180)
    distortion: float = quantity(-0.05, "", "radial distortion k1 of the lens", "assumed", ge=-0.4, le=0.4)
    marker_offset: float = quantity(0.028, "m", "markers in front of the bending plane", "assumed: on flags", ge=0)
    blur: float = quantity(0.8, "px", "standard deviation of the lens's blur", "assumed", ge=0)
    gradient: float = quantity(0.5, "", "difference of light across the picture, over its mean", "assumed", ge=0, lt=2)
    contrast: float = quantity(0.75, "", "of the markers' print", "assumed", gt=0, le=1)
    noise: float = quantity(4.0, "", "standard deviation of each pixel, of 255", "assumed", ge=0)


class CharucoBoard(Section):
    """The ChArUco board for calibration (dictionary 5x5_50, whose ids no wrist marker shares)."""

    columns: int = choice(7, "squares across", ge=3, le=12)
    rows: int = choice(9, "squares down", ge=3, le=12)
    square: float = quantity(0.025, "m", "side of a square", "fits A4 and letter", gt=0)
    marker: float = quantity(0.018, "m", "side of a marker in a white square", gt=0)

    @model_validator(mode="after")
    def _marker_in_square(self) -> Self:
        if not 0.4 * self.square <= self.marker <= 0.85 * self.square:
            raise ValueError(f"a marker of {self.marker} m needs a square of 1.2 to 2.5 times that")
        if self.columns * self.rows // 2 > 50:
            raise ValueError(f"{self.columns} x {self.rows} squares need more than the 50 markers of the dictionary")
        return self


class Device(Section):
    """Settings of a camera device, read back after they are set. Null leaves a setting as it is."""

    fourcc: str | None = choice(
        None, "pixel format: MJPG gives most webcams their full rate", min_length=4, max_length=4
    )
    width: int | None = quantity(None, "px", "picture width", gt=0)
    height: int | None = quantity(None, "px", "picture height", gt=0)
    frame_rate: float | None = quantity(None, "1/s", "frames per second", gt=0)
    automatic: bool = choice(False, "leave exposure, focus and white balance to the device: pictures then change by it")
    exposure: float | None = quantity(None, "", "in the device's own unit: on Linux 0.1 ms for most", gt=0)
    gain: float | None = quantity(None, "", "in the device's own unit", ge=0)
    focus: float | None = quantity(None, "", "in the device's own unit", ge=0)
    white_balance: float | None = quantity(None, "K", "colour temperature", gt=0)
    power_line: Literal["off", "50 Hz", "60 Hz"] | None = choice(None, "lamps whose flicker the device guards against")
    delay: float = quantity(0.0, "s", "from the middle of the exposure to the device's time stamp", "assumed", ge=0)


class CalibrateCameraSettings(Section):
    """Intrinsics and distortion from views of the board; the last view has the board lie in the bending plane."""

    camera: str | int | None = choice(None, "device (0, /dev/video0), video or folder of pictures; null renders views")
    views: int = choice(20, "views to take (device, video, rendered)", ge=8, le=200)
    in_plane: bool = choice(True, "the last view shows the board lying in the bending plane")
    coverage: float = quantity(0.6, "", "least share of the picture in which corners were seen", "assumed", gt=0, le=1)
    tilt_deg: float = quantity(15.0, "deg", "least tilt of the most tilted view", "assumed", ge=0, lt=60)
    error: float = quantity(1.0, "px", "largest reprojection error (RMS)", "assumed", gt=0)
    board: CharucoBoard = CharucoBoard()
    device: Device = Device()
    scene: SceneSettings = SceneSettings()


class TrackSettings(Section):
    """Angles from a recording."""

    video: str | None = choice(None, "video file or folder of pictures")
    video_2: str | None = choice(
        None, "that of a second camera, of a wrist in two planes: it looks at the flexion-extension plane"
    )
    frame_rate: float | None = quantity(None, "1/s", "frames per second; null reads it from the video", gt=0)
    calibration: str | None = choice(None, "calibrate-camera run; without one the camera is taken to stand square")
    calibration_2: str | None = choice(None, "calibrate-camera run of the second camera")
    zero: Literal["none", "first"] = choice("none", "angle that counts as 0: markers aligned, or the first one seen")
    annotate: bool = choice(False, "write the video with corners and angle drawn in, data/annotated.avi")
    markers: Markers = Markers()
    markers_2: Markers = choice(Markers(base=2, tip=3), "markers that the second camera sees")
    gates: Gates = Gates()
