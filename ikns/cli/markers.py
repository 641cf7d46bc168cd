"""``ikns markers``: marker sets, those that come along and one's own."""

from __future__ import annotations

import typer

import ikns
from ikns.cli.checks import checked
from ikns.cli.marker_options import (
    SetArgument,
    millimeters,
)
from ikns.cli.markers_check import check
from ikns.cli.markers_new import new
from ikns.cli.options import AsJson
from ikns.cli.output import held_sentences, show, table

markers_app = typer.Typer(
    help="List, show, make and check marker sets.",
    no_args_is_help=True,
    add_completion=False,
)


def list_(as_json: AsJson = False) -> None:
    """List the marker sets that come with ikns."""
    found = [ikns.MarkerSet.load(name) for name in ikns.MarkerSet.names()]
    show(
        {
            "sets": [
                {
                    "name": each.name,
                    "markers": len(each.markers),
                    "static_only": [m.label for m in each.markers if m.static_only],
                    "held": each.held,
                    "source": each.source,
                }
                for each in found
            ]
        },
        table(
            "Marker sets",
            {"name": "s", "markers": "d", "held joints": "d", "first labels": "s"},
            [
                [
                    each.name,
                    len(each.markers),
                    len(each.held),
                    ", ".join(each.labels[:6]),
                ]
                for each in found
            ],
        ),
        "Your own, from a static trial: ikns markers new static.c3d --out mine.toml",
        as_json=as_json,
    )


def show_(marker_set: SetArgument, as_json: AsJson = False) -> None:
    """Show a marker set: where each marker sits, and which joints are held."""
    worn = ikns.MarkerSet.load(marker_set)
    rows = [
        {
            "label": m.label,
            "segment": m.link,
            "position_m": m.position,
            "placement_sd_m": m.placement_sd,
            "static_only": m.static_only,
            "weight": m.weight,
            "aliases": m.aliases,
        }
        for m in worn.markers
    ]
    show(
        {
            "name": worn.name,
            "source": worn.source,
            "held": worn.held,
            "markers": rows,
        },
        table(
            f"{worn.name}: {worn.source}",
            {
                "marker": "s",
                "segment": "s",
                "forward, up, right mm": "s",
                "sd mm": "s",
                "note": "s",
            },
            [
                [
                    m.label,
                    m.link,
                    millimeters(m.position),
                    millimeters(m.placement_sd),
                    "; ".join(
                        [
                            *(["static only"] if m.static_only else []),
                            *([f"weight {m.weight:g}"] if m.weight != 1 else []),
                            *([f"also {', '.join(m.aliases)}"] if m.aliases else []),
                        ]
                    ),
                ]
                for m in worn.markers
            ],
        ),
        *held_sentences(worn.held),
        as_json=as_json,
    )


def sites_(as_json: AsJson = False) -> None:
    """List the places on the body that `ikns markers new` knows."""
    from ikns.body.sites import sites

    known = sites().values()
    show(
        {
            "sites": [
                {
                    "name": each.name,
                    "about": each.about,
                    "segment": each.link,
                    "position_m": each.position,
                    "usual_labels": each.labels,
                }
                for each in known
            ]
        },
        table(
            "Places on the body; each right_ one also as left_",
            {"place": "s", "what it is": "s", "usual labels": "s"},
            [
                [each.name, each.about, ", ".join(each.labels)]
                for each in known
                if each.side != "left"
            ],
        ),
        as_json=as_json,
    )


for name_, command in (
    ("list", list_),
    ("show", show_),
    ("check", check),
    ("new", new),
    ("sites", sites_),
):
    markers_app.command(name_)(checked(command))
