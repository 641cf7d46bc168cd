"""How a live run went, as JSON and as a table for people."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ikns.cli.output import show, table

if TYPE_CHECKING:
    from ikns.live.publish import Publishers
    from ikns.live.runtime import Report


def show_report(
    report: Report,
    title: str,
    session: Path | None,
    losses: list[str],
    publisher: Publishers | None,
    *,
    as_json: bool,
) -> None:
    """Print how a run went."""
    from ikns.live.runtime.report import frames

    published = None if publisher is None else publisher.counts
    result = _result(report) | {
        "session": session,
        "losses": losses,
        "published": published,
    }
    show(
        result,
        table(
            title,
            {"quantity": "s", "value": "s"},
            _rows(report, published),
        ),
        *(
            f"{c.time:9.3f} s  {c.before} to {c.after}: {c.reason}"
            for c in report.transitions[-12:]
        ),
        *(f"{frames(n)}: {why}" for why, n in _most(report.rejections)),
        *([f"Wrote {session}"] if session else []),
        as_json=as_json,
    )


def _most(rejections: dict[str, int]) -> list[tuple[str, int]]:
    """Return the most frequent reasons."""
    return list(rejections.items())[:12]


def _result(report: Report) -> dict[str, Any]:
    return {
        "frames": report.frames,
        "seconds": report.seconds,
        "deadline_misses": report.misses,
        "latency_s": {
            name: {
                "p50": times.percentile(50),
                "p99": times.percentile(99),
                "p999": times.percentile(99.9),
                "worst": times.percentile(100),
            }
            for name, times in report.stages.items()
        },
        "source": report.source,
        "problem": report.problem,
        "rejections": report.rejections,
        "frames_held": report.held,
        "notices": report.notices,
        "transitions": [change._asdict() for change in report.transitions],
        "lost_rows": report.lost_rows,
    }


def _rows(report: Report, published: dict[str, Any] | None) -> list[list[str]]:
    total = report.stages["total"]
    counted = report.source
    return [
        ["frames", str(report.frames)],
        ["seconds", f"{report.seconds:.1f}"],
        ["frames rejected", str(sum(report.rejections.values()))],
        *(
            []
            if report.held is None
            else [["frames held, hand faster than --hold-speed", str(report.held)]]
        ),
        [
            "dropped, late, repeated, out of order",
            ", ".join(
                str(counted[name])
                for name in ("dropped", "late", "repeated", "out_of_order")
            ),
        ],
        [
            "receipt to command, p50 / p99 / worst ms",
            " / ".join(f"{1e3 * total.percentile(p):.2f}" for p in (50, 99, 100)),
        ],
        ["frames that took longer than a frame period", str(report.misses)],
        ["rows missing on disk", str(report.lost_rows)],
        *(
            [["published / dropped", "{sent} / {dropped}".format(**published)]]
            if published
            else []
        ),
    ]
