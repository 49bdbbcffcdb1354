"""Where compiled kernels are kept: in the user's cache, or on this machine alone where that is shared with others.

On a network's file system several machines would write the same index, each for its own processor, and read files that
another is replacing.
"""

import os
import tempfile
from pathlib import Path

NAMED = "WRISTCTL_KERNELS"
"""Environment variable that names another folder."""
_SHARED = ("nfs", "nfs4", "lustre", "gpfs", "beegfs", "cifs", "smb3", "ceph", "afs", "panfs", "glusterfs", "fuse.sshfs")
_MOUNTS = Path("/proc/self/mounts")


def kernels_folder() -> Path:
    """The folder, which may not be there yet. PermissionError where another user has taken its place."""
    if named := os.environ.get(NAMED):
        return Path(named)
    usual = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "wristctl" / "kernels"
    return _of_this_machine() if is_shared(usual) else usual


def is_shared(folder: Path) -> bool:
    """Whether a folder lies on a file system of a network."""
    try:
        mounts = [line.split()[1:3] for line in _MOUNTS.read_text(encoding="utf-8").splitlines()]
    except OSError:
        return False
    place = folder.resolve()
    below = [(len(point), kind) for point, kind in mounts if place.is_relative_to(_unescaped(point))]
    return bool(below) and max(below)[1] in _SHARED


def _unescaped(point: str) -> str:
    return point.encode().decode("unicode_escape") if "\\" in point else point


def _of_this_machine() -> Path:
    """What lies there is run: so it is the user's own."""
    folder = Path(tempfile.gettempdir()) / f"wristctl-kernels-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    known = folder.lstat()
    if known.st_uid != os.getuid() or known.st_mode & 0o022 or folder.is_symlink():
        raise PermissionError(f"{folder} is not this user's alone")
    return folder
