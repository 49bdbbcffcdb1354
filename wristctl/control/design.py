"""A law that is made from settings of its own, which stand in a study with units: weights, horizons, sizes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from wristctl.config.foreign import PLAIN
from wristctl.config.section import Parameter
from wristctl.control.law import Controller
from wristctl.errors import UserError, meant
from wristctl.plugins.places import contained


@dataclass(frozen=True)
class LawDesign:
    """Makes a controller from the settings of a study, `controller-settings: {lqr: {angle_weight: 400}}`.

    What `make` works out before a law runs, as numbers or as functions that it closes over, is part of the compiled
    law: other settings compile anew.
    """

    name: str
    section: Mapping[str, Parameter]
    """The settings: default, unit and meaning of each."""
    make: Callable[[Mapping[str, float]], Controller]
    """A controller of this name, from every setting by name."""

    def values(self, settings: Mapping[str, float]) -> dict[str, float]:
        """Every setting: as given, or as by default."""
        return {name: float(settings.get(name, parameter.default)) for name, parameter in self.section.items()}

    def made(self, settings: Mapping[str, float]) -> Controller:
        """The controller for these settings, the others as by default. Raises UserError for what is none of them."""
        for key in settings:
            if key not in self.section:
                raise UserError(
                    f"unknown setting '{key}' of {self.name}",
                    f"controller-settings.{self.name}",
                    meant(key, self.section),
                )
        with contained(f"making {self.name} of these settings", f"controller-settings.{self.name}"):
            controller = self.make(self.values(settings))
        if not isinstance(controller, Controller) or controller.name.removesuffix(PLAIN) != self.name:
            raise UserError(
                f"{self.name} makes no controller of that name",
                f"controller-settings.{self.name}",
                "mend what makes it",
            )
        return replace(controller, settings=self.section)
