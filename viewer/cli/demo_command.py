"""`iibr demo`: the window on the photo that comes along."""

from __future__ import annotations

from iibr_core.scenes.scene import Source
from viewer.model.demo_photo import demo_photo


def demo() -> None:
    """Open the viewer on the demo photo.

    Example: iibr demo
    """
    from viewer.app.main_loop import initial_state, run
    from viewer.app.preferences_store import user_folder

    run(initial_state(Source(str(demo_photo()))), user_folder())
