"""Numbers that Python shares with scripts and kernels."""

import re

import pytest

from mplicits.trainer.networks import losses, muon
from mplicits.web import constants
from mplicits.web.bundle import modules, script
from support.paths import ROOT

KERNEL = (ROOT / "web" / "kernel" / "siren.c").read_text("utf-8")
WGSL = (ROOT / "web" / "kernel" / "step.wgsl").read_text("utf-8")


def test_the_scripts_have_python_s_numbers() -> None:
    """`python -m mplicits.web.constants` writes the file."""
    assert constants.FILE.read_text("utf-8") == constants.text()


def test_a_page_holds_the_numbers_that_it_reads() -> None:
    text = script(modules("rays.js"))
    assert re.findall("^const ([A-Z_]+) = ", text, re.MULTILINE)[0] == "DELTA_FACTOR"
    assert "NEWTON_SCHULZ" not in text


@pytest.mark.parametrize(("text", "pattern"), [(KERNEL, r"LACK = ([\d.]+)f"), (WGSL, r"const LACK = ([\d.]+);")])
def test_kernels_have_the_share_of_lacking_values(text: str, pattern: str) -> None:
    assert [float(number) for number in re.findall(pattern, text)] == [losses.LACK]


def test_the_kernel_has_muon_s_polynomial() -> None:
    assert all(f"{coefficient:g}f" in KERNEL for coefficient in muon.COEFFICIENTS)


def test_shaders_have_the_factor_of_a_band() -> None:
    march = (ROOT / "glsl" / "functions" / "march.glsl").read_text("utf-8")
    assert f"width / {constants.number(constants.NUMBERS['DELTA_FACTOR']):g}" in march
