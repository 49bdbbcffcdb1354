"""A signature tells who vouched for a run, and does not survive a change, another key or another purpose."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from wristctl.cli.app import main
from wristctl.config.errors import UserError
from wristctl.records import Run
from wristctl.records.manifest import SIGNATURE
from wristctl.records.seal import write_seal
from wristctl.records.signature import sign, signature

Make = Callable[..., Run]
pytestmark = pytest.mark.skipif(shutil.which("ssh-keygen") is None, reason="needs OpenSSH")


@pytest.fixture
def keys(tmp_path: Path) -> dict[str, Path]:
    """Two keys, and a file of allowed signers that knows the first."""
    made = {}
    for name in ("ada", "eve"):
        made[name] = tmp_path / name
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(made[name])], check=True)
    made["signers"] = tmp_path / "signers"
    public = (tmp_path / "ada.pub").read_text().split()[:2]
    made["signers"].write_text(f"ada@example.org {' '.join(public)}\n")
    return made


def test_who_signed_a_run_is_told_and_the_run_is_as_it_was_sealed(make: Make, keys: dict[str, Path]) -> None:
    run = make()
    assert sign(run, keys["ada"]).key.startswith("SHA256:")
    assert run.problems() == []
    found = signature(run, keys["signers"])
    assert (found.signer, found.fault) == ("ada@example.org", "")
    assert signature(run, None).signer == ""


def test_a_run_that_was_changed_and_sealed_anew_is_no_longer_signed(make: Make, keys: dict[str, Path]) -> None:
    run = make()
    sign(run, keys["ada"])
    (run.path / "config.yaml").write_text("seed: 3\n")
    with pytest.raises(UserError, match="hash does not match"):
        sign(run, keys["ada"])
    write_seal(run.path, {})
    assert run.problems() == [], "the seal alone cannot tell"
    assert "not of this SHA256SUMS" in signature(run, keys["signers"]).fault


def test_the_signature_of_a_stranger_or_for_another_purpose_does_not_count(make: Make, keys: dict[str, Path]) -> None:
    run = make()
    sign(run, keys["eve"])
    assert "is nobody's in" in signature(run, keys["signers"]).fault
    (run.path / SIGNATURE).unlink()
    other = ["ssh-keygen", "-Y", "sign", "-q", "-f", str(keys["ada"]), "-n", "file", str(run.path / "SHA256SUMS")]
    subprocess.run(other, check=True)
    assert signature(run, keys["signers"]).fault


def test_what_cannot_be_signed_or_checked_says_why(make: Make, keys: dict[str, Path], tmp_path: Path) -> None:
    run = make()
    with pytest.raises(UserError, match="not signed"):
        signature(run, None)
    with pytest.raises(UserError, match="cannot sign"):
        sign(run, tmp_path / "absent")
    sign(run, keys["ada"])
    with pytest.raises(UserError, match="No such file"):
        signature(run, tmp_path / "absent")
    (run.path / SIGNATURE).write_text("scribbled")
    assert signature(run, keys["signers"]).fault


def test_the_commands_say_so(
    make: Make, keys: dict[str, Path], results: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    signed, bare = make(), make("tune")

    def call(*arguments: str) -> tuple[object, str]:
        monkeypatch.setattr(sys, "argv", ["wristctl", "runs", *arguments, "--out", str(results)])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, "".join(capsys.readouterr())

    assert call("sign", signed.id, "--key", str(keys["ada"]))[0] == 0
    code, said = call("verify", signed.id, "--signers", str(keys["signers"]))
    assert code == 0 and "as sealed, signed by ada@example.org with SHA256:" in said
    code, said = call("verify", "--signed")
    assert code == 3 and f"{bare.id}  as sealed, but nobody vouches for it\n  SHA256SUMS.sig: run is not signed" in said
    assert call("verify")[0] == 0
    assert call("verify", "--signers", "absent")[0] == 2
