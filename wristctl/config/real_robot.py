"""Validation on a real robot: which one, where its recordings are, and what its model has."""

from typing import Literal

from pydantic import field_validator

from wristctl.config.choices import ROBOTS
from wristctl.config.given_files import given_file, of_file
from wristctl.config.section import OneOf, Section, choice

TermName = Literal["slack", "tendon friction", "inner friction", "creep"]


class RealRobotSettings(Section):
    """A robot whose recordings its authors published."""

    robot: str | None = choice(None, "real robot, as --list has it")
    data: str | None = of_file("folder that holds its recordings, as its authors published them")
    files: tuple[str, ...] = given_file("its recordings, where not by their folder", ())
    terms: tuple[TermName, ...] | None = choice(
        None, "what its model has beside elastic arcs and tendons; null: what the predicted part wants"
    )

    @field_validator("robot")
    @classmethod
    def _robot_is_there(cls, robot: str | None) -> str | None:
        return None if robot is None else OneOf(ROBOTS).checked(robot)
