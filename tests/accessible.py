"""What every page must hold on a phone and on a desk.

Accessibility is judged by axe-core (https://github.com/dequelabs/axe-core), WCAG 2.1 A
and AA; of its four impacts none may be serious or critical.
"""

from typing import Any

from axe_playwright_python.sync_playwright import Axe

#: Not higher than what shows everything: 3-D is drawn in software.
PHONE, DESK = {"width": 390, "height": 640}, {"width": 1280, "height": 560}
_OPTIONS = {
    "resultTypes": ["violations"],
    "runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"],
}


def judge(page: Any) -> None:
    """Fail on a page that is wider than its window, or that axe-core finds at fault."""
    for size in (DESK, PHONE):
        page.set_viewport_size(size)
        wide = page.evaluate("document.documentElement.scrollWidth")
        assert wide <= size["width"], size
        found = Axe().run(page, options=_OPTIONS).response["violations"]
        faults = [
            (fault["id"], node["html"][:120], node["failureSummary"])
            for fault in found
            if fault["impact"] in ("serious", "critical")
            for node in fault["nodes"]
        ]
        assert faults == [], size
