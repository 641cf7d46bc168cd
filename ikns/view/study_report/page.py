"""The page of a study: answers first, simulated parts labeled, nothing loaded."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files

from ikns.experiments.study.summary import Group, StudySummary
from ikns.experiments.study.summary.answers import (
    people,
    picking_answer,
    tracking_answer,
)
from ikns.view.parts import (
    Cell,
    NextStep,
    ReportPage,
    Section,
    facts_html,
    inline,
    steps_html,
)
from ikns.view.report import html_document

#: The people, or the simulated participants, with the sections on them.
GroupPart = tuple[Group, Sequence[Section]]

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
    simulated = all(group.simulated for group, _ in parts)
    several = len(parts) > 1
    page = _StudyPage()
    title = f"Study {summary.name}"
    body = [
        "<header>",
        f'<p class="banner">{_BANNER}</p>' if simulated else "",
        f"<h1>{inline(title)}</h1>",
        f'<p class="lead">{inline(_lead(summary, parts))}</p>',
        facts_html(_facts(summary, parts)),
        *(_answers(group, several=several) for group, _ in parts),
        "</header><main>",
    ]
    for group, sections in parts:
        page.of(simulated=group.simulated)
        if several:
            name = "Simulated participants" if group.simulated else "People"
            body.append(f'<section class="part"><h1>{name}</h1>')
            if group.simulated:
                body.append(f'<p class="banner">{_BANNER}</p>')
            body.append("</section>")
        if group.simulated:
            cannot = Section(
                "What such a simulation can and cannot show", list(_CANNOT)
            )
            body.append(page.section(cannot))
        body += [page.section(section) for section in sections]
    page.of(simulated=False)
    if left_out is not None:
        body.append(page.section(left_out))
    body += [steps_html(next_steps), "</main>"]
    return html_document(f"{title} (simulated)" if simulated else title, css, body)


class _StudyPage(ReportPage):
    """A page whose parts differ in whether they are simulated."""

    def __init__(self) -> None:
        super().__init__(simulated=False)

    def of(self, *, simulated: bool) -> None:
        """Label what follows."""
        self.suffix = ReportPage(simulated).suffix

    def section(self, section: Section) -> str:
        """Say in the heading too that it is simulated."""
        html = super().section(section)
        return html.replace("</h2>", f"{self.suffix}</h2>", 1)


def _lead(summary: StudySummary, parts: Sequence[GroupPart]) -> str:
    who = [people(_count(group), simulated=group.simulated) for group, _ in parts]
    apart = (
        " People and simulated participants are analyzed apart, people first."
        if len(parts) > 1
        else ""
    )
    planned = summary.plan.get("participants")
    came = sum(
        _count(group)
        for group, _ in parts
        if group.simulated == summary.plan.get("simulated")
    )
    so_far = (
        f" The study file declares {planned}, so this is a part of them."
        if planned and came < planned
        else ""
    )
    return (
        f"Results of {' and '.join(who)}, computed again from the recorded attempts "
        f"of {summary.visits} visits.{so_far}{apart}"
    )


def _count(group: Group) -> int:
    """How many came to any experiment."""
    who: set[str] = set()
    for each in (group.tracking, group.picking):
        who |= set() if each is None else {name for _, name in each.folders}
    return len(who)


def _facts(summary: StudySummary, parts: Sequence[GroupPart]) -> dict[str, Cell]:
    facts: dict[str, Cell] = {}
    for group, _ in parts:
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


def _answers(group: Group, *, several: bool) -> str:
    questions = [
        *tracking_answer(group.tracking, simulated=group.simulated),
        *picking_answer(group.picking, simulated=group.simulated),
    ]
    tag = ReportPage(group.simulated).suffix
    who = ""
    if several:
        who = ": simulated participants" if group.simulated else ": people"
    parts = [f'<section class="answers"><h2>Answers{who}{tag}</h2>']
    for question, sentences in questions:
        parts.append(f"<h3>{inline(question)}</h3>")
        parts += [f"<p>{inline(sentence)}</p>" for sentence in sentences]
    if group.simulated:
        parts.append(
            "<p>These are answers about a model of people, not about people.</p>"
        )
    return "\n".join([*parts, "</section>"])
