"""Variables of a MATLAB file, as a recorder saves them."""

from pathlib import Path
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.plain_files import LARGEST_DATA, open_plain
from wristctl.records.recorded_table import cannot_read


def variables_of(file: Path, what: str) -> dict[str, Any]:
    """All variables by their names; `what` is what an error calls the file.

    Raises UserError for a file of version 7.3, which is HDF5, and for one that cannot be read.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        with open_plain(file, LARGEST_DATA) as stream:
            return loadmat(stream)  # type: ignore[arg-type] # its stubs know paths alone
    except NotImplementedError:
        raise UserError("a .mat file of version 7.3", str(file), "save it with MATLAB's option -v7") from None
    except (OSError, ValueError, MatReadError) as error:
        raise cannot_read(what, file, error) from error


def vectors_of(file: Path, what: str) -> dict[str, Array]:
    """Vectors of numbers by their names, each (N,) with a length of its own. Raises UserError as `variables_of`."""
    variables = variables_of(file, what)
    arrays = {name: np.asarray(value) for name, value in variables.items() if not name.startswith("__")}
    return {
        name: value.ravel().astype(np.float64)
        for name, value in arrays.items()
        if value.dtype.kind in "iuf" and value.ndim and value.size == max(value.shape)
    }
