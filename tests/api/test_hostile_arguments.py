"""Values of any type, as arguments of a field and as options of a verb: taken, or refused with the argument's name."""

import math
import re
from collections.abc import Callable
from contextlib import ExitStack
from itertools import product
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
import torch

import mplicits
from mplicits import cli
from mplicits.model.errors import UserError
from mplicits.model.model_file import save
from mplicits.scenes.compose import compose
from support.random_model import random_model

ARRAY = np.random.default_rng(0).uniform(-1, 1, (20, 3))
TENSOR = torch.from_numpy(ARRAY.astype(np.float32))
POINTS: dict[str, Callable[[], Any]] = {
    "grid": lambda: ARRAY.reshape(4, 5, 3),
    "lists": ARRAY.tolist,
    "empty": lambda: np.zeros((0, 3)),
    "point": lambda: [0, 0, 0],
    "number": lambda: np.array(3.0),
    "text": lambda: "text",
    "texts": lambda: [["1", "2", "3"]],
    "complex": lambda: ARRAY + 1j,
    "bools": lambda: ARRAY > 0,
    "objects": lambda: ARRAY.astype(object),
    "masked": lambda: np.ma.masked_array(ARRAY, ARRAY > 0.5),
    "dates": lambda: np.zeros((2, 3), "M8[s]"),
    "halves": lambda: ARRAY.astype(np.float16),
    "bytes": lambda: ARRAY.astype(np.uint8),
    "huge": lambda: ARRAY * 1e300,
    "nan": lambda: np.full((2, 3), np.nan),
    "wide": lambda: np.zeros((2, 4)),
    "ragged": lambda: [[1, 2, 3], [4]],
    "none": lambda: None,
    "strided": lambda: np.zeros((4, 6))[:, ::2],
    "fortran": lambda: np.asfortranarray(ARRAY),
    "readonly": lambda: np.broadcast_to(ARRAY[0], (5, 3)),
    "tensor": lambda: TENSOR,
    "bf16": TENSOR.bfloat16,
    "half": TENSOR.half,
    "int": TENSOR.int,
    "double": TENSOR.double,
    "grad": lambda: TENSOR.clone().requires_grad_(),
    "no_grad": lambda: TENSOR.clone().requires_grad_(),
    "meta": lambda: TENSOR.to("meta"),
    "sparse": TENSOR.to_sparse,
    "quantized": lambda: torch.quantize_per_tensor(TENSOR, 0.1, 0, torch.qint8),
    "nested": lambda: torch.nested.nested_tensor([TENSOR, TENSOR]),
    "inference": torch.inference_mode()(TENSOR.clone),
    "inside inference": lambda: TENSOR,
    "complex tensor": lambda: TENSOR + 1j,
    "vmap": lambda: TENSOR,
    "expanded": lambda: TENSOR[:1].expand(7, 3),
    "parameter": lambda: torch.nn.Parameter(TENSOR.clone()),
}
REFUSED = {
    *("number", "text", "texts", "complex", "masked", "dates", "wide", "ragged", "none"),
    *("meta", "sparse", "quantized", "nested", "complex tensor", "vmap"),
}
"""Those that are no real numbers, or not three of each point."""
KEYWORDS: dict[str, tuple[Any, ...]] = {
    "level": (None, 1, 2, 0, -1, 9, 1.0, True, "1", np.int64(1), np.array(1), np.nan, [1], 10**400),
    "time": (0.0, 0.5, 1.0, 2.0, -1.0, np.nan, np.inf, "0.5", True, np.array(0.5), [0.5], None, 0.5j, 10**400),
    "space": ("model", "input", "file", None, ["model"], 3),
}
"""Argument -> values; the first is the usual one."""
CALLS = ("sdf", "gradient", "color", "trace")
OPTIONS: tuple[Any, ...] = (
    *(None, True, 0, -1, 1, 2.5, math.nan, math.inf, 10**400, "", "12", "x", "1,2", b"x", [], [1], [1, 2], (1, 2, 3)),
    *({}, {"a": 1}, ["x"], (None, None), 1j, object, np.float32(2), np.int64(3), np.array(4), np.array([1.0, 2.0])),
    *(np.array(True), "\u202e\n", "9" * 5000),
)


@pytest.fixture(scope="module")
def fields(tmp_path_factory: pytest.TempPathFactory) -> list[mplicits.Field]:
    """A still one, a moving one, a scene, and one without colors."""
    folder, still = tmp_path_factory.mktemp("scene"), random_model((4, 1), (4, 0), texture=(4, 0))
    save(still, folder / "part.safetensors")
    (folder / "two.toml").write_text('[[parts]]\nmodel = "part.safetensors"\ntranslate = ["t", 0, 0]\n')
    models = (still, random_model((4, 1), (4, 0), inputs="xyzt"), compose(folder / "two.toml"), random_model((4, 0)))
    return [mplicits.Field(model) for model in models]


def called(field: mplicits.Field, call: str, kind: str, keywords: dict[str, Any]) -> None:
    """Call a function of a field. Its result has the shape of the points."""
    points = POINTS[kind]()

    def result_of(given: Any) -> Any:
        if call == "trace":
            return field.trace(given, [0.0, 0.0, 1.0], **keywords).t
        return getattr(field, call)(given, **keywords)

    with ExitStack() as stack:
        stack.enter_context(np.errstate(all="ignore"))
        if kind == "vmap":
            torch.func.vmap(result_of)(points)
            return
        if kind in ("inside inference", "no_grad"):
            stack.enter_context(torch.no_grad() if kind == "no_grad" else torch.inference_mode())
        result = result_of(points)
    shape = tuple(points.shape) if hasattr(points, "shape") else np.shape(points)
    assert tuple(result.shape) == (shape if call in ("gradient", "color") else shape[:-1])
    if isinstance(points, torch.Tensor) and call != "trace":
        assert result.dtype == torch.float32


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", POINTS)
def test_a_field_takes_arguments_or_names_them(kind: str, fields: list[mplicits.Field]) -> None:
    random = Random(kind)
    for field, call in product(fields, CALLS):
        keywords = {name: random.choice((values[0],) * 10 + values) for name, values in KEYWORDS.items()}
        if call == "color":
            del keywords["level"]
        try:
            called(field, call, kind, keywords)
        except (UserError, TypeError) as error:
            said = str(error)
        else:
            assert kind not in REFUSED, (call, keywords)
            continue
        assert re.search("points|level|time|space|origins|directions", said), (call, keywords)
        assert said.isprintable()


@pytest.mark.parametrize("verb", cli.verbs())
def test_an_option_is_taken_or_named(verb: str) -> None:
    schema = cli.verbs()[verb].options
    fields = schema.__dataclass_fields__
    needed: dict[str, Any] = {name: "x" for name, each in fields.items() if each.kw_only}
    needed |= {name: Path("x") for name in needed if "Path" in str(fields[name].type)}
    if "checkpoints" in needed:
        needed["checkpoints"] = [Path("x")]
    for name, value in product((name for name, each in fields.items() if each.init), OPTIONS):
        more = {"depth": "x"} if "estimate" in fields and name != "estimate" else {}
        try:
            options = schema(**needed | more | {name: value})
            if hasattr(options, "settings"):
                options.settings()
        except UserError as error:
            said = str(error)
        else:
            continue
        assert name in said.replace("-", "_"), value
        assert said.isprintable()
