"""Panels: functions from state to actions, redrawn from state each frame; they hold no state."""
