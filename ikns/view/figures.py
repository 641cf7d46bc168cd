"""Every figure of the package: plain SI arrays in, a matplotlib Figure out.

No figure uses pyplot or needs a screen. Each takes ``simulated``, whether the data come
from a virtual subject, and says so in its title. Arrays of the wrong shape raise
InvalidInput.
"""

from ikns.view.body import arm_points
from ikns.view.comparison import comparison_figure
from ikns.view.directions import directions_figure, principal_angle_figure
from ikns.view.hand_places import hand_places_figure
from ikns.view.methods import methods_figure
from ikns.view.residuals import residual_figure
from ikns.view.signals import control_figure, swivel_figure
from ikns.view.variance_split import variance_split_figure
from ikns.view.workspace import workspace_figure

__all__ = [
    "arm_points",
    "comparison_figure",
    "control_figure",
    "directions_figure",
    "hand_places_figure",
    "methods_figure",
    "principal_angle_figure",
    "residual_figure",
    "swivel_figure",
    "variance_split_figure",
    "workspace_figure",
]
