"""The page of a study: answers first, simulated parts labeled, nothing loaded."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from typing import NamedTuple

from ikns.experiments.study.summary import Group, StudySummary
from ikns.experiments.study.summary.answers import (
    people,
    picking_answer,
    tracking_answer,
)
from ikns.output.wording import counted
from ikns.view.cells import Cell, inline
from ikns.view.parts import (
    NextStep,
    Picture,
    ReportPage,
    Section,
    facts_html,
    steps_html,
)
from ikns.view.report import html_document


class GroupPart(NamedTuple):
    """People, or simulated participants: their answers, and sections on them."""

    group: Group
    answers: Picture | None
    sections: Sequence[Section]


_BANNER = "Simulated: no person took part"

#: What a simulation can and cannot show.
_CANNOT = (
    "What such a simulation can show: that design, recording, map, control signal and "
    "statistics work together from end to end; how error, noise, delay and gaps pass "
    "through that chain; how many participants a real study would need; which settings "
    "matter to the method itself.",
    "What it cannot show: how well people do. The operators follow a model of human "
    "tracking whose free parameters were taken from the literature, and many settings "
    "of them fit the paper's figures as well; the difference between two devices is "
    "largely what was put into the model. Comfort, fatigue, attention, "
    "embodiment and learning by understanding are not in it. A difference between "
    "conditions here, or none, is no evidence about people.",
)


def study_html(
    summary: StudySummary,
    parts: Sequence[GroupPart],
    *,
    left_out: Section | None,
    next_steps: Sequence[NextStep],
) -> str:
    """Return the page; same input, same text."""
    css = "".join(
        files(package).joinpath(name).read_text(encoding="utf-8")
        for package, name in (
            ("ikns.view", "report.css"),
            ("ikns.view.study_report", "study.css"),
        )
    )
    simulated = all(part.group.simulated for part in parts)
    page = _StudyPage(several=len(parts) > 1)
    title = f"Study {summary.name}"
    main = [_answers(page, part) for part in parts]
    for part in parts:
        main += _part(page, part)
    page.of(simulated=False)
    if left_out is not None:
        main.append(page.section(left_out))
    body = [
        "<header>",
        f'<p class="banner">{_BANNER}</p>' if simulated else "",
        f"<h1>{inline(title)}</h1>",
        f'<p class="lead">{inline(_lead(summary, parts))}</p>',
        page.contents(),
        "</header><main>",
        *main,
        steps_html(next_steps),
        "</main><footer>",
        facts_html(_facts(summary, parts)),
        "</footer>",
    ]
    return html_document(f"{title} (simulated)" if simulated else title, css, body)


def _part(page: _StudyPage, part: GroupPart) -> list[str]:
    """Return everything on the people, or on the simulated participants."""
    group, body = part.group, []
    page.of(simulated=group.simulated)
    if page.several:
        name = "Simulated participants" if group.simulated else "People"
        body.append(f'<section class="part"><h1>{name}</h1>')
        if group.simulated:
            body.append(f'<p class="banner">{_BANNER}</p>')
        body.append("</section>")
    if group.simulated:
        cannot = Section("What such a simulation can and cannot show", list(_CANNOT))
        body.append(page.section(cannot))
    return body + [page.section(section) for section in part.sections]


class _StudyPage(ReportPage):
    """A page whose parts differ in whether they are simulated."""

    def __init__(self, *, several: bool) -> None:
        super().__init__(simulated=False)
        self.several = several

    def of(self, *, simulated: bool) -> None:
        """Label what follows, headings too."""
        self.suffix = self.section_tag = ReportPage(simulated).suffix

    def anchor(self, title: str) -> str:
        """Tell headings of people and of simulated participants apart."""
        return super().anchor(
            f"{title} (simulated)" if self.several and self.suffix else title
        )


def _lead(summary: StudySummary, parts: Sequence[GroupPart]) -> str:
    groups = [part.group for part in parts]
    who = [people(_count(group), simulated=group.simulated) for group in groups]
    apart = (
        " People and simulated participants are analyzed apart, people first."
        if len(parts) > 1
        else ""
    )
    planned = summary.plan.get("participants")
    came = sum(
        _count(group)
        for group in groups
        if group.simulated == summary.plan.get("simulated")
    )
    so_far = (
        f" The study file declares {planned}, so this is a part of them."
        if planned and came < planned
        else ""
    )
    return (
        f"Results of {' and '.join(who)}, computed again from the recorded attempts "
        f"of {counted(summary.visits, 'visit')}.{so_far}{apart}"
    )


def _count(group: Group) -> int:
    """How many came to any experiment."""
    who: set[str] = set()
    for each in (group.tracking, group.picking):
        who |= set() if each is None else {name for _, name in each.folders}
    return len(who)


def _facts(summary: StudySummary, parts: Sequence[GroupPart]) -> dict[str, Cell]:
    facts: dict[str, Cell] = {}
    for group in (part.group for part in parts):
        kind = "simulated" if group.simulated else "people"
        for name, each in (
            ("tracking", group.tracking),
            ("pick and place", group.picking),
        ):
            if each is None:
                continue
            facts[f"{name}, {kind}"] = f"n = {len(each.participants)}"
            facts[f"conditions of {name}"] = ", ".join(each.conditions)
    facts["visits used"] = summary.visits
    facts["visits left out"] = len(summary.left_out)
    return facts


def _answers(page: _StudyPage, part: GroupPart) -> str:
    group = part.group
    page.of(simulated=group.simulated)
    questions = [
        *tracking_answer(group.tracking, simulated=group.simulated),
        *picking_answer(group.picking, simulated=group.simulated),
    ]
    who = ""
    if page.several:
        who = ": simulated participants" if group.simulated else ": people"
    heading, anchor = f"Answers{who}{page.section_tag}", page.anchor("Answers")
    parts = [f'<section class="answers" id="{anchor}"><h2>{heading}</h2>']
    if part.answers is not None:
        parts.append(page.picture(part.answers))
    for question, sentences in questions:
        parts.append(f"<h3>{inline(question)}</h3>")
        parts += [f"<p>{inline(sentence)}</p>" for sentence in sentences]
    if group.simulated:
        parts.append(
            "<p>These are answers about a model of people, not about people.</p>"
        )
    return "\n".join([*parts, "</section>"])
