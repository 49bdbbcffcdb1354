"""The tables of newcomers' places are read without what they name."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from wristctl.config import choices
from wristctl.config.choices import Choices
from wristctl.errors import UserError

ROOT = Path(__file__).parents[2]
CODE = """
import importlib, pkgutil, sys
import wristctl.config as config
for module in pkgutil.iter_modules(config.__path__, "wristctl.config."):
    importlib.import_module(module.name)
from wristctl.study_files.load import load_study
load_study([], ["simulate={controller: pid, reference: {kind: sine}}", "tune.optimiser=random"])
print(*sys.modules)
"""
TABLES = [name for name, each in vars(choices).items() if isinstance(each, Choices)]


@pytest.mark.slow
def test_a_study_is_read_without_physics_or_arrays() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], cwd=ROOT, capture_output=True, text=True, check=True)
    loaded = done.stdout.split()
    assert not {name.split(".")[0] for name in loaded} & {"numpy", "numba", "scipy", "pandas", "matplotlib", "torch"}
    own = {name.split(".")[1] for name in loaded if name.startswith("wristctl.")}
    assert own == {
        "config",
        "errors",
        "escape",
        "interrupt",
        "plain_files",
        "plugins",
        "sha256sums",
        "study_files",
        "version",
    }


@pytest.mark.parametrize("name", TABLES)
def test_every_entry_is_where_its_table_says_and_a_name_near_it_is_meant(name: str) -> None:
    table: Choices[object] = getattr(choices, name)
    for each in table:
        assert table[each] is not None and table[each] is table.named(each)
        with pytest.raises(UserError, match=f"unknown {table.what}.*did you mean '{each}'"):
            table.named(f"{each}x")
