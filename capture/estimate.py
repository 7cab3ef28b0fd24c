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
    from transformers import pipeline, utils

    logging: Any = utils.logging
    logging.set_verbosity_error()
    logging.disable_progress_bar()
    try:
        # Nothing of the model runs as code: no Python files beside it, and no weights but .safetensors, since other
        # formats are pickles. Without `trust_remote_code`, transformers would ask on the terminal.
        safe: dict[str, Any] = {"trust_remote_code": False, "model_kwargs": {"use_safetensors": True}}
        run: Any = pipeline("depth-estimation", model=estimator, **safe)
        with torch.no_grad():
            predicted = run(photograph)["predicted_depth"]
        values = np.squeeze(np.asarray(predicted.cpu().float().numpy(), np.float64))
        if values.ndim != 2:
            raise ValueError(f"its output has {values.ndim} axes, not 2")
    except Exception as error:  # transformers raises anything on damaged folders
        reason = show(str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__)[:200]
        where = "a folder" if is_folder(Path(estimator)) else "a model on the hub, or no folder"
        raise UserError(f"--estimator {show(estimator)}: {where} that cannot be loaded ({reason})") from None
    if values.shape != (photograph.height, photograph.width):
        scaled = Image.fromarray(values.astype(np.float32)).resize(photograph.size, Image.Resampling.BILINEAR)
        values = np.asarray(scaled, np.float64)
    values = np.where(np.isfinite(values) & (values > 0), values, np.nan)
    if np.isnan(values).all():
        raise UserError(f"--estimator {show(estimator)}: it finds no depth in this picture")
    return values, getattr(run.model.config, "depth_estimation_type", "relative") != "metric"
