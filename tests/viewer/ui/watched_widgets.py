"""The real widgets of ImGui, watched as the panel builds them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pytest
from imgui_bundle import imgui


def watch_widgets(
    monkeypatch: pytest.MonkeyPatch,
    kinds: Iterable[str],
    found: list[Any],
    record: Callable[[str, tuple[Any, ...]], None],
) -> None:
    """Call record with the kind and the arguments of each widget of these kinds, once it is built. found: what it
    fills, emptied whenever the panel begins.
    """

    def watch(kind: str) -> None:
        real = getattr(imgui, kind)

        def build(*arguments: Any) -> Any:
            result = real(*arguments)
            record(kind, arguments)
            return result

        monkeypatch.setattr(imgui, kind, build)

    for kind in kinds:
        watch(kind)
    begin = imgui.begin

    def begin_again(name: str, *others: Any) -> Any:
        if name == "panel":
            found.clear()
        return begin(name, *others)

    monkeypatch.setattr(imgui, "begin", begin_again)
