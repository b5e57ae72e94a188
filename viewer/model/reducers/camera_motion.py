"""Viewpoints that move by themselves: the glide home, and loops through the grid. A step is a pure function of time."""

from __future__ import annotations

import math
from dataclasses import replace

from iibr_core.beyond.optics import CENTRE, Optics
from iibr_core.exports.loops import point_on_loop
from iibr_core.types import GridShape, ViewOffset
from viewer.model.state.motion import Motion, MotionKind

HOME_S = 0.4

LONGEST_STEP_S = 0.1
"""After a hiccup the motion goes on from where it was, without a leap."""

EASE_IN_TURNS = 0.2
"""A loop leaves the viewpoint it began at over this part of its first turn."""


def start_motion(motion: Motion, kind: MotionKind | None, optics: Optics) -> Motion:
    """The motion that starts at the present viewpoint; None stops."""
    return Motion(kind, start=optics.eye, start_dolly=optics.dolly, speed=motion.speed)


def advance_motion(motion: Motion, optics: Optics, grid: GridShape, now_s: float) -> tuple[Motion, Optics]:
    """Motion and optics when the clock shows now_s. Glides end where they arrive."""
    if not motion.is_running or not math.isfinite(now_s):
        return motion, optics
    step_s = 0.0 if motion.ticked_s is None else min(max(now_s - motion.ticked_s, 0.0), LONGEST_STEP_S)
    turns = motion.turns + step_s * (1 / HOME_S if motion.kind == "home" else motion.speed)
    motion = replace(motion, turns=turns, ticked_s=now_s)
    if motion.kind == "home":
        left = 1 - ease(turns)
        eye = ViewOffset(motion.start.t * left, motion.start.s * left)
        there = replace(optics, eye=eye, dolly=motion.start_dolly * left)
        return (replace(motion, kind=None), replace(there, eye=CENTRE, dolly=0.0)) if turns >= 1 else (motion, there)
    share = ease(turns / EASE_IN_TURNS)
    goal = point_on_loop(motion.kind, turns, grid)
    eye = ViewOffset(*(a + share * (b - a) for a, b in zip(motion.start, goal)))
    return motion, replace(optics, eye=eye)


def ease(share: float) -> float:
    """0..1 to 0..1, slow at both ends."""
    x = min(max(share, 0.0), 1.0)
    return x * x * (3 - 2 * x)
