"""The numbers of Python that scripts need, too: writes model/constants.js.

    python -m mplicits.web.constants

Pages hold the numbers that they read (bundle.py). A test compares the file, and the numbers in the kernels.
"""

import json
import re
from importlib import import_module
from pathlib import Path
from typing import Any, cast

NUMBERS = {
    "DELTA_FACTOR": "model.model.DELTA_FACTOR",
    "DEFAULT_STEP_BOUND": "model.model.DEFAULT_STEP_BOUND",
    "FIRST_ITERATIONS": "model.model.DEFAULT_ITERATIONS.0",
    "ITERATIONS": "model.model.DEFAULT_ITERATIONS.1",
    "TRAINED_FINE": "model.quantize.MAX_FINE",
    "TRAINED_HIDDEN": "model.quantize.MAX_HIDDEN",
    "CLIP": "model.quantize.CLIP",
    "TOLERANCE": "model.quantize.TOLERANCE",
    "DIGITS_SHARE": "field.digits.SHARE",
    "MOST_DIGITS": "field.digits.MOST",
    "WIDEST_LITERAL": "codegen.targets.function_target.WIDEST",
    "LONGEST_NAME": "codegen.targets.function_target.LONGEST_NAME",
    "WIDEST": "codegen.targets.shadertoy.WIDEST",
    "SOFTBOX_SHARE": "codegen.targets.shadertoy_text.SOFTBOX_SHARE",
    "SAME": "readers.tidy.EQUAL",
    "HUGE": "trainer.shapes.checks.LARGEST",
    "FEWEST_POINTS": "trainer.shapes.checks.FEWEST",
    "APART": "trainer.shapes.duplicates.APART",
    "CANCELED": "trainer.shapes.duplicates.CANCELED",
    "NEIGHBORS": "trainer.shapes.planes.NEIGHBORS",
    "WIDTH": "trainer.shapes.planes.WIDTH",
    "SPREAD_OF_PLANES": "trainer.shapes.planes.SPREAD",
    "SIDEWAYS_OF_FOOT": "trainer.shapes.planes.SIDEWAYS",
    "TRUSTED": "trainer.shapes.planes.TRUSTED",
    "OPEN": "trainer.shapes.cloud.OPEN",
    "SHARPER": "trainer.shapes.creases.SHARPER",
    "SHARP": "trainer.shapes.creases.SHARP",
    "LEAST_COSINE": "trainer.shapes.creases.LEAST_COSINE",
    "MOST_CUTS": "trainer.shapes.curved.MOST_CUTS",
    "MOST_FACETS": "trainer.shapes.curved.MOST_FACETS",
    "DECIMALS_OF_PLACES": "trainer.shapes.curved.DECIMALS",
    "CREASE_SINE_SQUARED": "trainer.shapes.curved.CREASE_SINE_SQUARED",
    "ALONG_CREASE": "trainer.shapes.curved.ALONG",
    "LACK": "trainer.networks.losses.LACK",
    "WARM_UP": "trainer.networks.fit.WARM_UP",
    "WATCH_FROM": "trainer.networks.fit.WATCH_FROM",
    "IDLE": "trainer.networks.fit.IDLE",
    "WINDOW": "trainer.networks.fit.WINDOW",
    "RESTARTS": "trainer.networks.fit.RESTARTS",
    "SLOWER": "trainer.networks.fit.SLOWER",
    "MEAN": "trainer.networks.optimizer.BETAS.0",
    "VARIANCE": "trainer.networks.optimizer.BETAS.1",
    "EPSILON": "trainer.networks.optimizer.EPSILON",
    "MOMENTUM": "trainer.networks.muon.MOMENTUM",
    "NEWTON_SCHULZ": "trainer.networks.muon.ITERATIONS",
    "ROOT_MEAN_SQUARE": "trainer.networks.muon.ROOT_MEAN_SQUARE",
    "NARROWEST": "trainer.networks.muon.NARROWEST",
    "BEND_SEED": "trainer.suited_omegas.SEED",
    "FEWEST_BENDS": "trainer.suited_omegas.FEWEST",
    "FIRST_GRAY": "trainer.texture.GRAY",
    "SEEDS": "trainer.train.SEEDS",
    "FLATTEST": "trainer.surface_distance.FLATTEST",
    "EXTENT": "mesher.grid.EXTENT",
    "SNAP": "mesher.grid.SNAP",
}
"""Name in the scripts -> where Python has the number, and the index in a tuple."""
FILE = Path(__file__).with_name("model") / "constants.js"


def number(place: str) -> float:
    """Return the number at a place of NUMBERS."""
    module, name, *index = re.split(r"\.(?=[A-Z_]+(?:$|\.\d))|\.(?=\d)", place)
    value: Any = getattr(import_module(f"..{module}", __package__), name)
    return cast(float, value[int(index[0])] if index else value)


def text() -> str:
    """Return the text of model/constants.js."""
    lines = [f"export const {name} = {json.dumps(number(place))};\n" for name, place in NUMBERS.items()]
    return "// Numbers of Python, which web/constants.py writes.\n" + "".join(lines)


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
