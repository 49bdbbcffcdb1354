"""The picture of a lineage: each run once, arrows from left to right, the run itself and odd ones marked."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

from wristctl.plotting.page import lineage_picture
from wristctl.records.lineage import Ancestor

SVG = "{http://www.w3.org/2000/svg}"
DATA = Ancestor("20260101T000000Z-gen-data-000001", "gen-data", "ok", "data")
NETWORK = Ancestor("n", "train", "ok", "network", (DATA,))
GAINS = Ancestor("g", "tune", "gone", "tuned", (NETWORK,))
TREE = Ancestor("c", "compare", "ok", "", (NETWORK, GAINS))
"""A comparison with a network and gains that were tuned behind that same network."""


def drawn(tree: Ancestor) -> ET.Element:
    return ET.fromstring(lineage_picture(tree).replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1))


def boxes(tree: Ancestor) -> dict[str, tuple[float, float, float, float]]:
    """Left, top, right and bottom of each run's box, by its id."""
    found = {}
    for group in drawn(tree).iter(f"{SVG}g"):
        box, name = group.find(f"{SVG}rect"), group.findtext(f"{SVG}title")
        assert box is not None and name is not None and name not in found
        x, y, width, height = (float(box.attrib[key]) for key in ("x", "y", "width", "height"))
        found[name] = (x, y, x + width, y + height)
    return found


def arrows(tree: Ancestor) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Where each arrow begins and where its head is."""
    paths = list(drawn(tree).iter(f"{SVG}path"))
    edges, heads = ([each.attrib["d"] for each in paths if each.get("class") == kind] for kind in ("edge", "head"))
    found = []
    for line, head in zip(edges, heads, strict=True):
        begin, tip = (re.match(r"M(\S+) (\S+?)[Cl]", each) for each in (line, head))
        assert begin is not None and tip is not None
        found.append(((float(begin[1]), float(begin[2])), (float(tip[1]), float(tip[2]))))
    return found


def test_a_run_made_from_nothing_has_no_picture() -> None:
    assert lineage_picture(DATA) == ""


def test_each_run_stands_once_right_of_all_it_was_made_from() -> None:
    found = boxes(TREE)
    assert set(found) == {DATA.id, "n", "g", "c"}
    for earlier, later in ((DATA.id, "n"), ("n", "g"), ("n", "c"), ("g", "c")):
        assert found[earlier][2] < found[later][0], f"{earlier} before {later}"
    assert len({box[0] for box in found.values()}) == 4 and len({box[1] for box in found.values()}) == 1


def test_runs_as_deep_as_each_other_stand_below_each_other_by_their_names() -> None:
    others = [Ancestor(name, "gen-data", "ok", name) for name in ("b", "a", "d")]
    found = boxes(Ancestor("e", "compare", "ok", "", tuple(others)))
    tops = [found[name][1] for name in "abd"]
    assert tops == sorted(tops) and len({found[name][0] for name in "abd"}) == 1
    assert found["a"][3] < found["b"][1] and found["b"][3] < found["d"][1], "with room between them"
    assert found["e"][1] == found["a"][1]


def test_every_box_and_arrow_is_within_the_picture() -> None:
    several = Ancestor("e", "compare", "ok", "", tuple(Ancestor(name, "tune", "ok", name) for name in "abcd"))
    for tree in (TREE, several):
        root, found = drawn(tree), list(boxes(tree).values())
        left, top, width, height = (float(each) for each in root.attrib["viewBox"].split())
        assert (left, top) == (0.0, 0.0)
        assert (width, height) == (float(root.attrib["width"]), float(root.attrib["height"]))
        assert min(box[0] for box in found) == width - max(box[2] for box in found) > 0.0
        assert min(box[1] for box in found) > 0.0 and 0.0 < height - max(box[3] for box in found) < 20.0


def test_an_arrow_leads_from_the_middle_of_what_was_read_to_the_middle_of_what_was_made() -> None:
    found = boxes(TREE)

    def sides(name: str) -> tuple[tuple[float, float], tuple[float, float]]:
        left, top, right, bottom = found[name]
        middle = 0.5 * (top + bottom)
        return (left, middle), (right, middle)

    pairs = ((DATA.id, "n"), ("n", "c"), ("n", "g"), ("g", "c"))
    expected = {(sides(earlier)[1], sides(later)[0]) for earlier, later in pairs}
    assert set(arrows(TREE)) == expected and len(arrows(TREE)) == len(pairs)


def test_arrows_arrive_level_from_the_left() -> None:
    several = Ancestor("e", "compare", "ok", "", tuple(Ancestor(name, "tune", "ok", name) for name in "ab"))
    found = boxes(several)
    for path in (each.attrib["d"] for each in drawn(several).iter(f"{SVG}path") if each.get("class") == "edge"):
        begin, first, second, end = points(path)
        assert first[1] == begin[1] and second[1] == end[1], "it leaves and arrives level"
        assert begin[0] < first[0] == second[0] < end[0] < found["e"][0]


def points(path: str) -> list[tuple[float, float]]:
    numbers = [float(each) for each in re.findall(r"-?[\d.]+", path)]
    return list(zip(numbers[::2], numbers[1::2], strict=True))


def test_boxes_say_what_a_run_is_and_mark_the_run_itself_and_those_that_are_not_as_they_were() -> None:
    marks, words = {}, {}
    for group in drawn(TREE).iter(f"{SVG}g"):
        name = str(group.findtext(f"{SVG}title"))
        marks[name], words[name] = group.get("class"), [text.text for text in group.iter(f"{SVG}text")]
    assert marks == {DATA.id: None, "n": None, "g": "odd", "c": "own"}
    assert words[DATA.id] == ["data", "20260101T000000Z … 000001"]
    assert (words["n"], words["g"], words["c"]) == (["network", "n"], ["gains (gone)", "g"], ["comparison", "c"])
    stopped = Ancestor("s", "sweep", "failed", "", (DATA,))
    (own,) = (group for group in drawn(stopped).iter(f"{SVG}g") if group.findtext(f"{SVG}title") == "s")
    assert own.get("class") == "own" and next(own.iter(f"{SVG}text")).text == "sweep (failed)"


def test_the_words_in_a_box_stand_within_it() -> None:
    for group in drawn(TREE).iter(f"{SVG}g"):
        left, top, _, bottom = boxes(TREE)[str(group.findtext(f"{SVG}title"))]
        places = [(float(text.attrib["x"]), float(text.attrib["y"])) for text in group.iter(f"{SVG}text")]
        assert all(left < x < left + 20.0 and top + 10.0 < y < bottom for x, y in places)
        assert places[1][1] - places[0][1] > 10.0, "two lines"


def test_an_id_of_26_letters_is_shown_whole() -> None:
    for count, whole in ((26, True), (27, False)):
        tree = Ancestor("x" * count, "tune", "ok", "", (DATA,))
        assert (f">{'x' * count}</text>" in lineage_picture(tree)) == whole


def test_what_a_run_is_called_is_text_and_no_markup() -> None:
    text = lineage_picture(Ancestor("<b>", "<i>", "<u>", "", (DATA,)))
    assert not re.search("<[biu]>", text) and text.count("&lt;b&gt;") == 2
