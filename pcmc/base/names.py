"""What the name of a part may be, for patches, cables, rooms, planes and the parts of a plan."""

from __future__ import annotations

from collections.abc import Iterable

from .errors import OptionError, PcmcError
from .validate import refuse

LONGEST = 100  # characters


def checked_name(
    what: str, name: object, *, empty: bool = False, error: type[PcmcError] = OptionError
) -> str:
    """The name as a plain text: 1 to 100 printable characters, no blank at either end.

    Line breaks, tabs, other control characters and halves of surrogate pairs are not printable; so a name
    stays in one line of a file or message. Each format escapes what is special to it.

    Parameters
    ----------
    what : the parameter, for the message: "Patch.name".
    empty : whether there may be no name, "".
    error : the exception to raise.

    >>> checked_name("Cable.name", "Süd/Ost")
    'Süd/Ost'
    >>> checked_name("Cable.name", "east\\n")
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: Cable.name: expected no blank at either end, found 'east\\n'; change
    the name
    """
    expected = ""
    if not isinstance(name, str):
        expected = "a text"
    elif not name and not empty:
        expected = "at least one character"
    elif name != name.strip():
        expected = "no blank at either end"
    elif not name.isprintable():
        odd = next(c for c in name if not c.isprintable())
        expected = f"printable characters and none like {odd!a}"
    elif len(name) > LONGEST:
        expected = f"at most {LONGEST} characters and not {len(name)}"
    if expected:
        refuse(what, name, expected, hint="change the name", error=error)
    return str(name)


def names_from_file(given: Iterable[str]) -> tuple[dict[str, str], str]:
    """A name that a part may have for each name in a file of another program, and a note on those changed.

    Characters that are not printable become blanks, long names are cut; different names stay different.

    >>> names_from_file(["roof", " east\\t1", "east 1"])
    ({'roof': 'roof', ' east\\t1': 'east 1 2', 'east 1': 'east 1'}, "1 names were changed, as ' east\\\\t1'")
    """
    raw = list(dict.fromkeys(given))
    names = {name: "".join(c if c.isprintable() else " " for c in name).strip() for name in raw}
    names = {name: text[:LONGEST].rstrip() or "unnamed" for name, text in names.items()}
    taken = {name for name, text in names.items() if name == text}
    changed = [name for name in raw if name not in taken]
    for name in changed:
        text, number = names[name], 1
        while names[name] in taken:
            number += 1
            names[name] = f"{text[: LONGEST - 10]} {number}"
        taken.add(names[name])
    note = f"{len(changed)} names were changed, as {changed[0][:40]!r}" if changed else ""
    return names, note
