"""Files of a repetition are identical, alike within a published tolerance, or differ at a named place."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from safetensors.numpy import save_file

from wristctl.records.formats import write_arrays, write_table
from wristctl.records.replay import FileComparison, compare_files

Compare = Callable[[float, float], FileComparison]


def _table(path: Path, value: float) -> None:
    write_table(path, {"name": np.array(["a", "b"]), "value": np.array([7.0, value])})


def _json(path: Path, value: float) -> None:
    path.write_text(json.dumps({"value": value, "unit": "rad"}, indent=2))


def _svg(path: Path, value: float) -> None:
    path.write_text(f'<path d="M 7.5 {value!r} L 1e3 0"/>')


WRITERS: dict[str, Callable[[Path, float], None]] = {
    ".csv": _table,
    ".npz": lambda path, value: write_arrays(path, {"value": np.array([[7.0, value]])}),
    ".safetensors": lambda path, value: save_file({"value": np.array([7.0, value])}, path),
    ".json": _json,
    ".svg": _svg,
}


@pytest.fixture(params=WRITERS)
def numbers(request: pytest.FixtureRequest, tmp_path: Path) -> Compare:
    """Compares two files of a format, which hold a number each beside others that are the same."""

    def compared(before: float, now: float) -> FileComparison:
        paths = [tmp_path / f"{name}{request.param}" for name in ("before", "now")]
        for path, value in zip(paths, (before, now), strict=True):
            WRITERS[request.param](path, value)
        return compare_files(*paths)

    return compared


@pytest.mark.parametrize("before", [1e4, -1e4, 2.5])
@pytest.mark.parametrize("sign", [1, -1])
def test_numbers_are_alike_up_to_a_millionth_of_what_they_were(numbers: Compare, before: float, sign: int) -> None:
    assert numbers(before, before) == ("identical", "")
    within, beyond = (before * (1 + sign * part) for part in (0.999e-6, 1.002e-6))
    assert numbers(before, within) == ("within tolerance", f"largest difference {abs(within - before):.2g}")
    assert numbers(before, beyond).verdict == "differs"


@pytest.mark.parametrize("sign", [1, -1])
def test_numbers_near_zero_are_alike_up_to_a_billionth(numbers: Compare, sign: int) -> None:
    assert numbers(0.0, sign * 0.999e-9).verdict == "within tolerance"
    assert numbers(0.0, sign * 1.001e-9).verdict == "differs"
    assert numbers(1e-9, -1e-9).verdict == "differs"


@pytest.mark.parametrize(("ending", "write"), [(".csv", write_table), (".npz", write_arrays)])
def test_no_number_is_alike_with_none_and_with_nothing_else(
    tmp_path: Path, ending: str, write: Callable[..., None]
) -> None:
    def compared(before: list[float], now: list[float]) -> str:
        paths = [tmp_path / f"{name}{ending}" for name in ("before", "now")]
        for path, values in zip(paths, (before, now), strict=True):
            write(path, {"time": np.array([0.0, 0.1, 0.2]), "value": np.array(values)})
        return compare_files(*paths).verdict

    nan, inf = np.nan, np.inf
    assert compared([nan, 1.0, inf], [nan, 1.0 + 1e-9, inf]) == "within tolerance"
    assert compared([nan, 1.0, inf], [0.0, 1.0, inf]) == "differs"
    assert compared([0.0, 1.0, inf], [nan, 1.0, inf]) == "differs"
    assert compared([nan, 1.0, inf], [nan, 1.0, -inf]) == "differs"
    assert compared([nan, 1.0, inf], [nan, 1.0, 1e300]) == "differs"


@pytest.mark.parametrize(("levels", "verdict"), [(5, "within tolerance"), (6, "differs")])
def test_pictures_are_alike_up_to_a_fiftieth_of_full_brightness_in_the_mean(
    tmp_path: Path, levels: int, verdict: str
) -> None:
    before, now = tmp_path / "before.png", tmp_path / "now.png"
    drawn = np.full((30, 20), 100, dtype=np.uint8)
    Image.fromarray(drawn).save(before)
    drawn[::2] += np.uint8(levels)
    drawn[1::2] -= np.uint8(levels)
    Image.fromarray(drawn).save(now)
    assert compare_files(before, now) == (verdict, f"mean difference of pixels {levels / 255:.2g} of 1")


def test_one_pixel_does_not_make_another_picture_but_another_size_does(tmp_path: Path) -> None:
    before, now = tmp_path / "before.png", tmp_path / "now.png"
    Image.fromarray(np.zeros((30, 20), dtype=np.uint8)).save(before)
    dotted = np.zeros((30, 20), dtype=np.uint8)
    dotted[3, 4] = 255
    Image.fromarray(dotted).save(now)
    assert compare_files(before, now).verdict == "within tolerance"
    Image.fromarray(np.zeros((30, 21), dtype=np.uint8)).save(now)
    assert compare_files(before, now) == ("differs", "20 x 30 pixels before, 21 x 30 now")


def test_a_table_differs_from_the_first_time_at_which_any_column_does(tmp_path: Path) -> None:
    time = np.arange(5) / 10
    a, b = tmp_path / "a.csv", tmp_path / "b.csv"
    frame = pd.DataFrame({"time": time, "theta": np.sin(time), "rate": np.cos(time), "state": list("mmmss")})
    frame.to_csv(a, index=False)
    rate, theta = frame["rate"].to_numpy().copy(), frame["theta"].to_numpy().copy()
    rate[3:] += 1e-3
    frame.assign(rate=rate).to_csv(b, index=False)
    assert compare_files(a, b) == ("differs", "column rate from time 0.3 s; largest difference 0.001")
    theta[4] -= 0.5
    frame.assign(theta=theta, rate=rate).to_csv(b, index=False)
    assert compare_files(a, b) == ("differs", "column rate from time 0.3 s; largest difference 0.5")
    frame.assign(state=list("mmsss")).to_csv(b, index=False)
    assert compare_files(a, b) == ("differs", "column state from time 0.2 s; largest difference 0")
    frame[:-1].to_csv(b, index=False)
    assert compare_files(a, b) == ("differs", "5 rows of 4 columns before, 4 rows of 4 columns now")
    frame.assign(load=0.0).to_csv(b, index=False)
    assert compare_files(a, b) == ("differs", "5 rows of 4 columns before, 5 rows of 5 columns now")
    frame.rename(columns={"rate": "speed"}).to_csv(b, index=False)
    assert compare_files(a, b) == ("differs", "column rate before, speed now")


def test_a_table_without_times_differs_from_a_row(tmp_path: Path) -> None:
    a, b = tmp_path / "a.csv", tmp_path / "b.csv"
    frame = pd.DataFrame({"name": ["x", None, "z"], "value": [1, 2, 3]})
    frame.to_csv(a, index=False)
    frame.assign(value=[1.0, 2.0, 3.0]).to_csv(b, index=False)
    assert compare_files(a, b).verdict == "within tolerance", "2 and 2.0 are the same number, empty is empty"
    frame.assign(value=[1, 2, 4]).to_csv(b, index=False)
    assert compare_files(a, b) == ("differs", "column value from row 2; largest difference 1")


def test_arrays_differ_from_a_time_or_place_or_by_their_shape(tmp_path: Path) -> None:
    a, b = tmp_path / "a.npz", tmp_path / "b.npz"
    time, theta = np.arange(4) / 2, np.zeros((2, 4))
    late = np.array([[0, 0, 1, 1], [0, 0, 0, 1]])
    np.savez(a, time=time, theta=theta)
    np.savez(b, time=time, theta=theta + late)
    assert compare_files(a, b).detail == "array theta from row [0, 2]; largest difference 1"
    np.savez(a, time=time, theta=theta.T)
    np.savez(b, time=time, theta=theta.T - 2 * late.T)
    assert compare_files(a, b).detail == "array theta from time 1 s; largest difference 2"
    np.savez(a, time=np.tile(time, (2, 1)), theta=theta)
    np.savez(b, time=np.tile(time, (2, 1)), theta=theta + late[::-1])
    assert compare_files(a, b).detail == "array theta from time 1.5 s; largest difference 1"
    np.savez(b, time=np.tile(time, (2, 1)), theta=theta[:, :3])
    assert compare_files(a, b) == ("differs", "array theta: (2, 4) before, (2, 3) now")
    np.savez(b, time=np.tile(time, (2, 1)))
    assert compare_files(a, b) == ("differs", "array theta: (2, 4) before, None now")


def test_text_is_alike_but_for_its_numbers(tmp_path: Path) -> None:
    first, second = tmp_path / "a.json", tmp_path / "b.json"
    first.write_text('{"rmse": 0.1,\n"n": 5}')
    second.write_text('{"rmse": 1.0e-1,\n"n": 5}')
    assert compare_files(first, second) == ("within tolerance", "largest difference 0")
    second.write_text('{"rmse": 0.1,\n"n": 6}')
    assert compare_files(first, second) == ("differs", "line 2: 5 before, 6 now")
    second.write_text('{"rmse": 0.1,\n"m": 5}')
    assert compare_files(first, second) == ("differs", "from line 2")


def test_drawings_whose_hashed_names_alone_differ_are_alike_and_exchanged_ones_differ(tmp_path: Path) -> None:
    """The names that matplotlib gives clip paths and markers hash last bits, which processors differ by."""
    before, after, other = (tmp_path / f"{name}.svg" for name in ("before", "after", "other"))
    drawn = '<clipPath id="{0}"/><path id="{1}" d="M 7.5 {2} L 1e3 0"/><use href="#{1}"/><g clip-path="url(#{3})"/>'
    before.write_text(drawn.format("pbd3bcf6753", "m0123456789", 0.3, "pbd3bcf6753"))
    after.write_text(drawn.format("pbb66218c93", "mabcdef0123", 0.1 + 0.2, "pbb66218c93"))
    other.write_text(drawn.format("pbb66218c93", "mabcdef0123", 0.3, "mabcdef0123"))
    assert compare_files(before, after).verdict == "within tolerance"
    assert compare_files(before, other).verdict == "differs"


@pytest.mark.parametrize("ending", [".npz", ".safetensors", ".png", ".csv"])
def test_a_file_that_cannot_be_read_differs_and_says_why(tmp_path: Path, ending: str) -> None:
    before, now = tmp_path / f"before{ending}", tmp_path / f"now{ending}"
    if ending == ".png":
        Image.fromarray(np.zeros((3, 2), dtype=np.uint8)).save(now)
    else:
        WRITERS[ending](now, 1.0)
    whole = now.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"", b"\xff\xfe" + whole[2:]):
        before.write_bytes(damaged)
        assert compare_files(before, now).verdict == "differs"
        assert compare_files(now, before).verdict == "differs"


def test_of_arrays_the_first_place_is_named_and_numbers_are_told_from_words(tmp_path: Path) -> None:
    words, numbers = np.array(["a", "b"]), np.array([1.0, 2.0])
    for name, arrays in (("a", {"x": words, "y": numbers}), ("b", {"x": numbers, "y": numbers + np.array([0.0, 1.0])})):
        np.savez(tmp_path / f"{name}.npz", **arrays)
    found = compare_files(tmp_path / "a.npz", tmp_path / "b.npz")
    assert found.verdict == "differs" and found.detail.startswith("array x from row 0")


def test_the_earlier_place_is_named_whichever_array_it_is_in(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", x=np.zeros((2, 3)), y=np.zeros((2, 3)))
    x, y = np.zeros((2, 3)), np.zeros((2, 3))
    x[1, 0], y[0, 2] = 1.0, 2.0
    np.savez(tmp_path / "b.npz", x=x, y=y)
    assert compare_files(tmp_path / "a.npz", tmp_path / "b.npz").detail.startswith("array y from row [0, 2]")


def test_a_tolerance_is_of_what_was_before(tmp_path: Path) -> None:
    pairs = ((1e6, 1e6 + 0.9, "within tolerance"), (1e6, 1e6 + 1.1, "differs"), (0.0, 1e-3, "differs"))
    for before, after, verdict in pairs:
        np.savez(tmp_path / "a.npz", x=np.array([before]))
        np.savez(tmp_path / "b.npz", x=np.array([after]))
        assert compare_files(tmp_path / "a.npz", tmp_path / "b.npz").verdict == verdict
    np.savez(tmp_path / "a.npz", x=np.array([1e6 + 1.0 + 5e-7]))
    np.savez(tmp_path / "b.npz", x=np.array([1e6]))
    assert compare_files(tmp_path / "a.npz", tmp_path / "b.npz").verdict == "within tolerance", "a millionth of before"
