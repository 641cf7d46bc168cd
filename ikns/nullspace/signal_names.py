"""How control signals are called: one name per freedom, wherever it is written."""

from __future__ import annotations


def signal_names(n_dof: int, word: str = "c") -> list[str]:
    """Names of control signals, or of what else there is one of by freedom of a map.

    The same in tables, sessions and streams.

    >>> signal_names(1), signal_names(2), signal_names(2, "flexion")
    (['c'], ['c_1', 'c_2'], ['flexion_1', 'flexion_2'])
    """
    return [word] if n_dof == 1 else [f"{word}_{k + 1}" for k in range(n_dof)]
