"""Three emulated servos that pull a wrist in two planes: `hw-run --rig servos`."""

from wristctl.rig import Sensor, Tendon
from wristctl.servos.dynamixel import DynamixelRig
from wristctl.servos.servo_settings import Servo, ServoSettings

SETTINGS = ServoSettings(
    servos=[Servo(number, Tendon(120.0 * (number - 1), 0.020)) for number in (1, 2, 3)],
    spool_radius=8e-3,
    torque_constant=1.30,
    tension=40.0,
    rate=0.06,
    sensor=Sensor(rate=100.0, delay=0.01, noise_deg=0.05),
)
"""XM430-W210 with spools of 8 mm, a sensor of the bend with 100 looks a second."""


class ServoBench(DynamixelRig):
    """Three emulated Dynamixel servos that pull a wrist in two planes, in virtual time: `hw-run --rig servos`."""

    facts = SETTINGS.facts

    def __init__(self) -> None:
        super().__init__(SETTINGS, "emulated")
