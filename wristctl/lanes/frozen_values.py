"""What compiling a function freezes into it beside its own text: values and functions in its globals and closures.

numba keeps compiled code by a function's own bytecode and closure. What that calls, and the numbers that a module read
from a file or worked out when it was imported, decide the result as well.
"""

import hashlib
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

_PACKAGE = Path(__file__).resolve().parents[1]


def frozen_values(function: Callable[..., Any]) -> tuple[bytes, tuple[Path, ...]]:
    """A hash over all that a function reaches outside this package, and the files of this package that it reaches.

    It reaches globals by the names in its code, attributes of modules too, and what its closure holds.
    """
    digest, files, seen = hashlib.sha256(), set[Path](), set[int]()
    waiting: list[Any] = [function]
    while waiting:
        value = waiting.pop()
        own = getattr(value, "py_func", getattr(value, "_defn", value))
        if not isinstance(own, FunctionType):
            digest.update(_told(value))
        elif id(own) not in seen:
            seen.add(id(own))
            file = Path(own.__code__.co_filename)
            if file.is_relative_to(_PACKAGE):
                files.add(file)
                continue
            digest.update(own.__qualname__.encode())
            for code in _codes(own.__code__):
                digest.update(code.co_code + repr((code.co_names, code.co_varnames, _plain(code.co_consts))).encode())
                waiting += _reached(own, code)
            waiting += [cell.cell_contents for cell in own.__closure__ or ()]
            waiting += [*(own.__defaults__ or ()), *(own.__kwdefaults__ or {}).values()]
    return digest.digest(), tuple(sorted(files))


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A function's code, and that of the functions within it."""
    yield code
    for each in code.co_consts:
        if isinstance(each, CodeType):
            yield from _codes(each)


def _plain(constants: tuple[Any, ...]) -> list[Any]:
    return [each for each in constants if not isinstance(each, CodeType)]


def _reached(function: FunctionType, code: CodeType) -> Iterator[Any]:
    """What the names in a code stand for: globals, and attributes of the modules among them."""
    found = {name: function.__globals__[name] for name in code.co_names if name in function.__globals__}
    for name in sorted(found):
        value = found[name]
        if isinstance(value, ModuleType):
            yield from (getattr(value, each) for each in sorted(code.co_names) if hasattr(value, each))
        else:
            yield value


def _told(value: Any) -> bytes:
    """A value as bytes that are the same in another process; what has none is told by where it is, and never kept."""
    if isinstance(value, np.ndarray):
        return repr((value.shape, value.dtype)).encode() + np.ascontiguousarray(value).tobytes()
    if isinstance(value, ModuleType):
        return value.__name__.encode()
    try:
        return pickle.dumps(value)
    except Exception:
        return repr(value).encode()
