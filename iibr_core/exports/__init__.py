"""Exports of a scene: the table in `kinds.py` names the function of each kind.

All raise InputError where they lack depth, memory or a place to write to, and Cancelled once the job is to stop.
"""
