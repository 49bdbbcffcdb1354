"""Vectors of a MATLAB file, as a recorder saves them."""

from pathlib import Path

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.plain_files import LARGEST_DATA, open_plain


def vectors_of(file: Path, what: str) -> dict[str, Array]:
    """Vectors of numbers by their names, each (N,) with a length of its own; `what` is what an error calls the file.

    Raises UserError for a file of version 7.3, which is HDF5, and for one that cannot be read.
    """
    from scipy.io import loadmat

    try:
        with open_plain(file, LARGEST_DATA) as stream:
            variables = loadmat(stream)  # type: ignore[arg-type] # its stubs know paths alone
    except NotImplementedError:
        raise UserError("a .mat file of version 7.3", str(file), "save it with MATLAB's option -v7") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise UserError(f"cannot read the {what}: {reason}", str(file), "check the path") from error
    arrays = {name: np.asarray(value) for name, value in variables.items() if not name.startswith("__")}
    return {
        name: value.ravel().astype(np.float64)
        for name, value in arrays.items()
        if value.dtype.kind in "iuf" and value.ndim and value.size == max(value.shape)
    }
