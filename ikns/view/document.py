"""An HTML document that loads nothing: head, style sheet and policy."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

__all__ = ["html_document"]


def html_document(title: str, style: str, body: Iterable[str]) -> str:
    """Return a document; the browser itself refuses whatever it would load.

    Title is plain text, style CSS; body are HTML elements, of which empty ones are left
    out.
    """
    parts = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        "img-src data:; style-src 'unsafe-inline'\">",
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<meta name="color-scheme" content="light dark">',
        f"<title>{escape(title)}</title>",
        f"<style>\n{style}</style></head><body>",
        *body,
        "</body></html>",
    ]
    return "\n".join(part for part in parts if part) + "\n"
