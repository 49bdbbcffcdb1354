"""Text of unknown origin on a terminal, where control characters would move the cursor or forge lines."""


def printable(text: object) -> str:
    """The text with what a terminal obeys, or cannot show, written as escapes: one line."""
    given = str(text)
    if given.isprintable():
        return given
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in given)


def printable_lines(text: object) -> str:
    """The same of a text of several lines, which keeps them."""
    return "\n".join(map(printable, str(text).split("\n")))
