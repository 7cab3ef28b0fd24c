"""Estimates depth from one photograph, by a pretrained network of the library transformers."""

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ..model.errors import UserError
from ..model.files import is_folder, show
from .cloud import Doubles


def estimate_depth(photograph: Image.Image, estimator: str) -> tuple[Doubles, bool]:
    """Estimate the depth of each pixel of an RGB photograph.

    estimator: a folder, or a name on the hub, of a model for transformers' pipeline "depth-estimation". Returns the
    numbers (H, W), NaN where the network says 0, and whether they are relative inverse depths (True) or meters (False),
    which the model's configuration says. Raises UserError if the network cannot be loaded, and ModuleNotFoundError
    without transformers.
    """
    import torch
    from huggingface_hub import logging as hub_logging
    from transformers import dynamic_module_utils, pipeline, utils

    loggings: tuple[Any, Any] = utils.logging, hub_logging
    for logging in loggings:
        logging.set_verbosity_error()
    loggings[0].disable_progress_bar()
    try:
        # Nothing of the model runs as code: no Python files beside it, and no weights but .safetensors, since other
        # formats are pickles. Without `trust_remote_code`, transformers would ask on the terminal; about a further
        # model that the configuration names it asks all the same, unless it may not wait for the answer.
        dynamic_module_utils.TIME_OUT_REMOTE_CODE = 0
        safe: dict[str, Any] = {"trust_remote_code": False, "model_kwargs": {"use_safetensors": True}}
        run: Any = pipeline("depth-estimation", model=estimator, **safe)
        with torch.no_grad():
            predicted = run(photograph)["predicted_depth"]
        values = np.squeeze(np.asarray(predicted.cpu().float().numpy(), np.float64))
        if values.ndim != 2:
            raise ValueError(f"its output has {values.ndim} axes, not 2")
    except Exception as error:  # transformers raises anything on damaged folders
        reason = show(str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__)[:200]
        folder = is_folder(Path(estimator))
        what = "a folder that cannot" if folder else "no folder, and no model on the hub that can"
        raise UserError(f"--estimator {show(estimator)}: {what} be loaded ({reason})") from None
    if values.shape != (photograph.height, photograph.width):
        scaled = Image.fromarray(values.astype(np.float32)).resize(photograph.size, Image.Resampling.BILINEAR)
        values = np.asarray(scaled, np.float64)
    values = np.where(np.isfinite(values) & (values > 0), values, np.nan)
    if np.isnan(values).all():
        raise UserError(f"--estimator {show(estimator)}: it finds no depth in this picture")
    return values, getattr(run.model.config, "depth_estimation_type", "relative") != "metric"
