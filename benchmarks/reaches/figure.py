"""c over time in both modes."""

from pathlib import Path

import numpy as np

from ikns.view.style import BLUE, GREY, INK, ORANGE, PALE, figure_style, new_figure
from reaches.modes import DEFAULT, controls
from reaches.simulated import CHAIN, Person


def draw(folder: Path, person: Person) -> None:
    """Draw c over time in both modes: natural reaches, then tracking."""
    subject = person.subject
    learned = subject.null_space_map
    made = controls(subject.skeleton, learned, CHAIN, list(subject.motions))
    with figure_style():
        figure = new_figure(
            "c in position and in rate mode", simulated=True, height=4.6
        )
        for axes, kind, title in zip(
            figure.subplots(2, 1),
            ("natural", "tracking"),
            ("Natural reaches (shaded): c should stay", "Following what is meant"),
            strict=True,
        ):
            session = getattr(person, kind)
            motion, known = session.motion, session.motion.time <= 30
            t = motion.time[known]
            position = learned.control_signal(
                motion.chain_angles(CHAIN), motion.task_position(CHAIN)
            )
            bare = made["rate, Jacobian, bare"]((0.0, 1.0)).track(motion)
            full = made[DEFAULT]((0.0, 1.0)).track(motion)
            for a, b in session.reaches():
                if motion.time[a] <= 30:
                    axes.axvspan(motion.time[a], motion.time[b], color=PALE, lw=0)
            if kind == "tracking":
                axes.plot(t, session.meant[known], color=INK, ls="--", label="meant")
            lines = ((bare, GREY, "rate, projection alone"),)
            lines += ((position, ORANGE, "position"), (full, BLUE, "rate"))
            for c, color, label in lines:
                axes.plot(t, np.clip(c, 0, 1)[known], color=color, label=label)
            axes.set(
                title=title, ylabel="c (no unit)", ylim=(-0.02, 1.02), xlim=(0, 30)
            )
        axes.set_xlabel("time (s)")
        figure.legend(
            *axes.get_legend_handles_labels(), loc="outside upper right", ncols=4
        )
        folder.mkdir(parents=True, exist_ok=True)
        for kind in ("png", "svg"):
            figure.savefig(folder / f"rate_mode.{kind}", dpi=150)
