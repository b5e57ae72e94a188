"""The state of the window and the verbs that change it: no GL, no ImGui, no threads."""
