"""What the program knows and how it changes: no GL, no ImGui, no threads."""
