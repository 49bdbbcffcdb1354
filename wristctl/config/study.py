"""A study: the wrist and what each command does with it. One file may hold one section or all of them."""

import re
from collections.abc import Mapping
from typing import Any, Self

from pydantic import Field, PrivateAttr, field_validator
from pydantic_core import PydanticCustomError

from wristctl.config.audit import AuditSettings
from wristctl.config.camera import CalibrateCameraSettings, TrackSettings
from wristctl.config.compare import CompareSettings
from wristctl.config.fair_study import FairStudySettings
from wristctl.config.families import Family
from wristctl.config.hw_run import CalibrateWristSettings, HwRunSettings
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.identify import IdentifySettings
from wristctl.config.learning import DataSettings, TrainSettings
from wristctl.config.real_robot import RealRobotSettings
from wristctl.config.recommend import RecommendSettings
from wristctl.config.section import Section
from wristctl.config.simulate import AnalyseSettings, SimulateSettings
from wristctl.config.tune import TuneSettings
from wristctl.config.wrist import WristParameters


class Origins(dict[tuple[str | int, ...], Any]):
    """Where keys of a study are from, by their paths; two studies are equal whichever these are."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Origins)


class Study(Section):
    """The whole file. Every section is validated, whichever command reads it."""

    seed: int = Field(0, ge=0, description="root of every random stream")
    wrist: WristParameters = WristParameters()
    families: dict[str, Family] = Field(
        {},
        description="families of worlds, by name, that tune and compare draw from",
        json_schema_extra={"unsaid": True},
    )
    sweep: tuple[str, ...] = Field(
        (), description="settings at many values, as KEY=1,2,3 or KEY=0..3:20", json_schema_extra={"unsaid": True}
    )
    controller_settings: dict[str, dict[str, float]] = Field(
        {},
        alias="controller-settings",
        description="settings of controllers of your own that have some, by the controller's name",
        json_schema_extra={"unsaid": True},
    )
    gen_data: DataSettings = Field(DataSettings(), alias="gen-data")
    train: TrainSettings = TrainSettings()
    tune: TuneSettings = TuneSettings()
    compare: CompareSettings = CompareSettings()
    study: FairStudySettings = FairStudySettings()
    recommend: RecommendSettings = RecommendSettings()
    simulate: SimulateSettings = SimulateSettings()
    analyse: AnalyseSettings = AnalyseSettings()
    audit: AuditSettings = AuditSettings()
    hysteresis: HysteresisSettings = HysteresisSettings()
    identify: IdentifySettings = IdentifySettings()
    real_robot: RealRobotSettings = Field(RealRobotSettings(), alias="real-robot")
    calibrate_camera: CalibrateCameraSettings = Field(CalibrateCameraSettings(), alias="calibrate-camera")
    calibrate_wrist: CalibrateWristSettings = Field(CalibrateWristSettings(), alias="calibrate-wrist")
    track: TrackSettings = TrackSettings()
    hw_run: HwRunSettings = Field(HwRunSettings(), alias="hw-run")
    _overrides: Origins = PrivateAttr(default_factory=Origins)

    @property
    def overrides(self) -> Mapping[tuple[str | int, ...], Any]:
        """Which keys were given beside files to `load_study`, which wins over what an identification tells."""
        return self._overrides

    def given_by(self, overrides: Mapping[tuple[str | int, ...], Any]) -> Self:
        """The study with these keys as given beside its files."""
        given = self.model_copy()
        given._overrides = Origins(overrides)
        return given

    @field_validator("families")
    @classmethod
    def _names_of_files(cls, families: dict[str, Family]) -> dict[str, Family]:
        """A family's name is part of the names of files of a run."""
        for name in families:
            if not re.fullmatch(r"[\w+-][\w .+-]{0,59}", name):
                problem = "{name} is no name for a family: letters, digits, spaces and . _ + - only, at most 60"
                raise PydanticCustomError("family_name", problem, {"name": repr(name)})
        return families
