"""The constants that Python and the page share, as JSON for model/facts.js."""

import json
from typing import Any

from ..codegen.printers.field import PLAIN, STORAGES
from ..codegen.printers.texels import TEXTURE_WIDTH, UNROLL
from ..codegen.targets import orbit
from ..codegen.targets.motion import PERIOD
from ..codegen.targets.samples import BLOCK, PLENTY, POWER, SHARE, STEEPEST
from ..codegen.targets.shader import FLOOR_BLOCK, FRAME, LEAST_STEPS, LOOP_LIMIT
from ..codegen.targets.uniforms import SHADING_PICTURES, SHADINGS, UNIFORMS
from ..field.cell_codes import EMPTY, OVERESTIMATE, REACH
from ..field.cell_search import FIRST, MISSED
from ..field.cells import LOOKUPS
from ..field.openness import EVALUATIONS
from ..model import packed_weights, range_coder
from ..model.checks import WIDEST
from ..model.endings import SHAPES
from ..model.model import DEFAULT_STEP_BOUND, MOST_ITERATIONS, STEP_BOUNDS
from ..model.model_file import FORMAT, TRAINING, VERSION

CELLS = {"first": 32, "second": 64, "last": 128}
"""Cells along an edge of the grids that the page computes: first, and then for models without motion."""
MANY, TOO_MANY = 100_000, 250_000
"""Numbers of weights above which the second grid is computed, and above which the last is not. At 175,000 weights, the
second and the last take 5 and 21 seconds, in the background."""
CELL_MOMENTS = 17
"""Number of grids for a moving model, evenly spaced in time."""
PAGE_FRAME = {step: name for step, name in FRAME.items() if name != "mask_unfinished"}
"""The steps of a frame of the page, in order, and the pass that each draws."""


def facts_json(facts: dict[str, Any], without: tuple[str, ...] = ()) -> str:
    """Write the JSON for web/model/facts.js: `facts`, and as `shared` the constants that Python and the page share.

    without: names of constants that the scripts do not read.

    It is safe in a script element: nothing in it opens or closes a tag or a comment.
    """
    shared = {
        "format": {
            "name": FORMAT,
            "version": VERSION,
            "widest": WIDEST,
            "most_iterations": MOST_ITERATIONS,
            "step_bounds": list(STEP_BOUNDS),
            "default_step_bound": DEFAULT_STEP_BOUND,
            "training": TRAINING,
        },
        "packed": {
            "widest": WIDEST,
            "offset": packed_weights.OFFSET,
            "bias": packed_weights.BIAS,
            "change": packed_weights.CHANGE,
            "weights_of_a_byte": packed_weights.WEIGHTS_OF_A_BYTE,
            "most_weights": packed_weights.MOST_WEIGHTS,
            "widest_bell": range_coder.WIDEST_BELL,
            "finest": range_coder.FINEST,
            "coarsest": range_coder.COARSEST,
            "total": range_coder.TOTAL,
            "quarters": range_coder.QUARTERS,
        },
        "shapes": SHAPES,
        "storages": STORAGES,
        "texture_width": TEXTURE_WIDTH,
        "unroll": UNROLL,
        "plain": PLAIN,
        "defaults": {entry.name: entry.default for entry in UNIFORMS if isinstance(entry.default, tuple)},
        "shadings": SHADINGS,
        "shading_labels": {shading.name: shading.label for shading in SHADING_PICTURES},
        "shading_keys": {shading.key.lower(): shading.name for shading in SHADING_PICTURES},
        "cells": {
            "first": FIRST,
            "counts": CELLS,
            "many": MANY,
            "too_many": TOO_MANY,
            "moments": CELL_MOMENTS,
            "overestimate": OVERESTIMATE,
            "reach": REACH,
            "empty": EMPTY,
            "missed": MISSED,
            "lookups": LOOKUPS,
        },
        "samples": {
            "share": SHARE,
            "plenty": PLENTY,
            "power": POWER,
            "steepest": STEEPEST,
            "block": BLOCK,
        },
        "period": PERIOD,
        "frame": PAGE_FRAME,
        "floor_block": FLOOR_BLOCK,
        "loop_limit": LOOP_LIMIT,
        "softbox_evaluations": EVALUATIONS,
        "least_steps": LEAST_STEPS,
        "camera": {
            "azimuth": orbit.AZIMUTH,
            "elevation": orbit.ELEVATION,
            "fov": orbit.FOV,
            "margin": orbit.MARGIN,
            "zoom": orbit.ZOOM,
        },
    }
    read = {name: value for name, value in shared.items() if name not in without}
    return json.dumps(facts | {"shared": read}).replace("<", "\\u003c")
