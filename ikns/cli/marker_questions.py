"""The questions of ``ikns markers new``: which label sits where."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from ikns.errors import InvalidInput


def ask_sites(
    labels: Sequence[str],
    *,
    guess: bool,
    moving: Sequence[str] = (),
    side: str | None = None,
) -> dict[str, str]:
    """Ask on the terminal where each label sits; answers as a file would have them.

    With `guess` nothing is asked, and labels that usually mean no place are left out.
    `moving` are the labels of a movement, if there is one: the others are static only.
    `side` is that of labels that name none.
    """
    from ikns.body.marker_set import label_keys
    from ikns.body.sites import guess_sites, site, sites, usual_site

    if guess:
        return guess_sites(labels, moving, side=side)
    answers: dict[str, str] = {}
    worn = label_keys(moving)
    _say(
        "Where does each marker sit? Enter accepts the place in brackets, 'skip' "
        "leaves "
        "the marker out, '?' lists places; add 'static' to what is worn in static "
        "trials only."
    )
    for label in labels:
        usual = usual_site(label, answers, labels, side=side)
        default = usual.name if usual else "skip"
        if usual and worn and not label_keys([label]) & worn:
            default += " static"
        while True:
            said = _answer(f"{label} [{default}]: ") or default
            words = said.split()
            if said == "?":
                _say(
                    "\n".join(
                        f"  {each.name}: {each.about}" for each in sites().values()
                    )
                )
                continue
            if said == "static":
                said = f"{default.removesuffix(' static')} static"
                words = said.split()
            if words == ["skip"]:
                break
            try:
                site(" ".join(words[:-1] if words[-1] == "static" else words))
            except InvalidInput as error:
                _say(f"  {error}")
                continue
            answers[label] = said
            break
    return answers


def _answer(question: str) -> str:
    sys.stderr.write(question)
    sys.stderr.flush()
    line = sys.stdin.readline()
    if not line:
        sys.stderr.write("\n")
        raise InvalidInput(
            "expected an answer for every marker, found the end of the input; give "
            "--sites FILE with a line LABEL=PLACE for each, or --guess."
        )
    return line.strip()


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")
