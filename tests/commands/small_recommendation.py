"""A recommendation of a moment, and a rig whose every part is stated."""

import wristctl
from wristctl.config.study import Study

QUICK = (
    "recommend={controllers: [pid-ff, ct-dob], loop: {plant_segments: 1, actuator: {level: ideal}, "
    "sensor: {level: ideal}}, "
    "draw: {plant.stiffness: x0.7..1.3, disturbances.load: '-0.3..0.3'}, horizon: 2.5, draws: 2, validation: 2, "
    "tests: 8, candidates: 4, iterations: 1, frequencies: [0.5, 1.0], payloads: [0.2]}"
)
RIG = (
    "recommend.loop={control_period: 1.0e-2, actuator: {level: tendon, friction: 0.2, step_rate: 9000}, "
    "sensor: {level: camera, frame_rate: 50, delay_frames: 3}}"
)


def study_of(*overrides: str) -> Study:
    """The study of the small recommendation, changed."""
    return wristctl.load_study(None, QUICK, *overrides)
