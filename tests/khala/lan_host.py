"""The human's side of PySC2's `play_vs_agent`, without its window: it steps and does nothing else.

It is PySC2's own code, but for two things. It is imported with the shuffle of an older Python, which its colours need;
and it says what to observe when it joins, which PySC2 says only with a window.
"""

import signal
from typing import Any

from absl import app

from khala_bridge.compat import old_shuffle

with old_shuffle():
    from pysc2.bin import play_vs_agent
    from pysc2.lib.remote_controller import RemoteController

join_game = RemoteController.join_game


def join_with_options(controller: RemoteController, request: Any) -> Any:
    """Join as a player with a window would, as far as units go."""
    request.options.raw = True
    return join_game(controller, request)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # which a job in the background of a shell ignores
    RemoteController.join_game = join_with_options
    app.run(play_vs_agent.main)
