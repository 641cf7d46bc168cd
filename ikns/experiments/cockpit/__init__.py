"""The participant's page and the experimenter's panel, served by a local web server.

`handlers` answers requests, `page_socket` talks with one connected page, `server` runs
both in a thread of its own. The pages are plain files in this folder: no build step,
and nothing is loaded from the network.
"""

from ikns.experiments.cockpit.server import Cockpit, check_port

__all__ = ["Cockpit", "check_port"]
