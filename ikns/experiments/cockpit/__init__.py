"""The participant's screen and the experimenter's panel, as web pages served here.

`gate` says who may come in, `link` talks with a page, `server` runs both in a thread of
its own. The pages are the files beside: no build step, nothing from the network.
"""

from ikns.experiments.cockpit.gate import Gate
from ikns.experiments.cockpit.server import Cockpit, check_port

__all__ = ["Cockpit", "Gate", "check_port"]
