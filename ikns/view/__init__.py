"""Pictures and pages of what the layers below know.

Names are handed out on first use: importing the package loads no plotting library.
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach(
    __name__,
    submod_attrs={
        "figures": [
            "arm_points",
            "control_figure",
            "directions_figure",
            "principal_angle_figure",
            "residual_figure",
            "swivel_figure",
            "workspace_figure",
        ],
        "report": ["KeyNumber", "Picture", "Section", "Step", "Table", "write_report"],
    },
)
