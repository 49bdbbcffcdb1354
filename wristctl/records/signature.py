"""Who sealed a run: an SSH signature over its SHA256SUMS, by OpenSSH's `ssh-keygen -Y` (8.2 or later).

The seal finds accidents; a signature finds people. It says that the holder of a key has vouched for every file of the
run as it is, and needs somebody who says whose key that is: an allowed signers file, as git and ssh-keygen have it.
"""

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

from wristctl.errors import Call, UserError
from wristctl.plain_files import open_plain
from wristctl.records.files import content_of, write_text
from wristctl.records.manifest import SIGNATURE, SUMS
from wristctl.records.run import Run

# A signature made for another purpose does not count.
NAMESPACE = "wristctl-run"
_KEY = "name a private SSH key: ssh-keygen -t ed25519 makes one"


class RunSignature(NamedTuple):
    """Signature of a run. `signer` is empty where the key belongs to no allowed signer."""

    signer: str
    key: str
    fault: str = ""


def sign(run: Run, key: Path) -> RunSignature:
    """Sign a run whose files are all as they were sealed, with a private key, or the public one where an agent has it.

    UserError where that is not so, or ssh-keygen refuses.
    """
    run.check()
    try:
        open_plain(key).close()  # ssh-keygen would wait for a pipe
    except OSError as error:
        raise UserError(f"cannot sign: {error.strerror}", str(key), _KEY) from error
    process = _ssh_keygen("sign", "-q", "-f", str(key), "-n", NAMESPACE, content=content_of(run.path / SUMS))
    if process.returncode != 0:
        raise UserError(f"cannot sign: {_error_text(process)}", str(key), _KEY)
    write_text(run.path / SIGNATURE, process.stdout.decode())
    return signature(run, None)


def is_signed(run: Run) -> bool:
    """Whether a run has a signature, be it worth something or not."""
    file = run.path / SIGNATURE
    return file.is_file() and not file.is_symlink()


def signature(run: Run, signers: Path | None) -> RunSignature:
    """Signer of a run. Raises UserError where the run is unsigned, or the allowed signers cannot be read."""
    file = run.path / SIGNATURE
    if not is_signed(run):
        raise UserError("run is not signed", str(run.path), ("ask whoever made it to run `", Call("runs sign"), "`"))
    content = content_of(run.path / SUMS)
    content_of(file)  # ssh-keygen would wait for a pipe
    valid = _ssh_keygen("check-novalidate", "-n", NAMESPACE, "-s", str(file), content=content)
    match = re.search(r"key (SHA256:\S+)", valid.stdout.decode(errors="replace"))
    if valid.returncode != 0 or not match:
        return RunSignature("", "", f"the signature is not of this {SUMS}: {_error_text(valid)}")
    key = match[1]
    if signers is None:
        return RunSignature("", key)
    content_of(signers)
    names = _ssh_keygen("find-principals", "-s", str(file), "-f", str(signers))
    for name in names.stdout.decode(errors="replace").splitlines():
        options = ("-f", str(signers), "-I", name, "-n", NAMESPACE, "-s", str(file))
        if _ssh_keygen("verify", *options, content=content).returncode == 0:
            return RunSignature(name, key)
    return RunSignature("", key, f"the key {key} is nobody's in {signers}")


def _ssh_keygen(action: str, *options: str, content: bytes = b"") -> subprocess.CompletedProcess[bytes]:
    program = shutil.which("ssh-keygen")
    if program is None:
        raise UserError("signatures need OpenSSH", "ssh-keygen", "install openssh-client")
    plain = {**os.environ, "LC_ALL": "C"}
    return subprocess.run([program, "-Y", action, *options], input=content, capture_output=True, env=plain)


def _error_text(process: subprocess.CompletedProcess[bytes]) -> str:
    lines = process.stderr.decode(errors="replace").split("\n")
    return next((line.strip() for line in lines if line.strip()), f"ssh-keygen ended with {process.returncode}")
