"""Exports of a scene: the table in `kinds.py` names the function of each kind."""
