"""Keys in long frames."""

from imgui_bundle import imgui

from viewer.app.keys import read_keys


def test_a_key_counts_with_the_modifiers_it_was_pressed_with(monkeypatch):
    """In a long frame Ctrl is up again before ImGui handles the key."""
    monkeypatch.setattr(imgui, "is_key_pressed", lambda key, repeats=True: key == imgui.Key.p)
    context = imgui.create_context()
    try:
        assert read_keys({}).commands == ("Compare with the photo",)
        assert read_keys({"p": (True, False)}).commands == ("All commands",)
    finally:
        imgui.destroy_context(context)
