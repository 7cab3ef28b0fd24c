"""A trained model is not lost where the output can no longer be written."""

import tempfile
from pathlib import Path

import pytest

from mplicits.model.errors import UserError
from mplicits.model.model import load, save
from mplicits.trainer import session
from support.random_model import random_model


def test_a_full_disk_at_the_end_loses_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    model, output, temporary = random_model((4, 0)), tmp_path / "a" / "m.safetensors", tmp_path / "tmp"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))

    def full(saved: object, path: Path) -> None:
        if path == output:
            raise UserError("cannot write m.safetensors: No space left on device")
        save(model, path)

    monkeypatch.setattr(session, "save", full)
    with pytest.raises(UserError, match=r"No space left.*the trained model is in .*m\.safetensors"):
        session._save(model, output)
    assert load(temporary / "m.safetensors").sha256() == model.sha256()
