"""Gather a headless Chromium for the stage `page` of on_gpu.py, in the ignored folder out/browser. Debian, x86-64.

    nice python benchmarks/pack_browser.py                    # needs the packages chromium-headless-shell and xz-utils
    nice python benchmarks/pack_browser.py --deb FILE.deb     # chromium-headless-shell unpacked from a file instead

1/, 2/, ...  parts of one archive, each at most PART bytes, so that they can travel one after the other

The browser brings its libraries except those that every machine with g++ has: glibc's and GCC's.
"""

import argparse
import json
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from gpu_browser import BROWSER, FONTS_FILE, PACK, SHELL

CHROMIUM = Path("/usr/lib/chromium")
SHARED = (
    "icudtl.dat",
    "v8_context_snapshot.bin",
    "libEGL.so",
    "libGLESv2.so",
    "libvulkan.so.1",
    "libvk_swiftshader.so",
    "vk_swiftshader_icd.json",
)
"""Files of the package chromium-common that the browser reads; SwiftShader is for the rehearsal."""
FONT = Path("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf")
FONTS = '<fontconfig><dir prefix="relative">.</dir><cachedir prefix="xdg">fontconfig</cachedir></fontconfig>\n'
"""The configuration of fontconfig: this font alone."""
OF_SYSTEM = r"(ld-linux.*|lib(c|m|dl|pthread|rt|resolv|gcc_s|stdc\+\+))\.so.*"
PART = 40 << 20
"""Bytes of a part."""


def copy_libraries(program: Path, folder: Path) -> None:
    """Copy the libraries of a program into a folder."""
    folder.mkdir()
    listed = subprocess.run(["ldd", str(program)], capture_output=True, text=True, check=True).stdout
    if missing := re.findall(r"(\S+) => not found", listed):
        raise SystemExit(f"libraries are missing: {', '.join(missing)}")
    for name, path in re.findall(r"(\S+) => (/\S+)", listed):
        if not re.fullmatch(OF_SYSTEM, name):
            shutil.copyfile(path, folder / name)


def gather(package: Path, folder: Path) -> None:
    """Copy the browser into a folder. package: where its own files are."""
    for path in (package / SHELL, *package.glob("headless_*.pak"), *(CHROMIUM / name for name in SHARED)):
        shutil.copy(path, folder / path.name)
    shutil.copyfile(FONT, folder / FONT.name)
    (folder / FONTS_FILE).write_text(FONTS, encoding="utf-8")
    copy_libraries(folder / SHELL, folder / "lib")


def main() -> None:
    """Fill the folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--deb", type=Path, help="file of the package chromium-headless-shell")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        package, folder = CHROMIUM, Path(name, BROWSER)
        folder.mkdir()
        if options.deb:
            subprocess.run(["dpkg", "-x", str(options.deb), name], check=True)
            package = Path(name) / CHROMIUM.relative_to("/")
        gather(package, folder)
        archive = Path(name, "browser.tar")
        subprocess.run(["tar", "-C", name, "-cf", str(archive), BROWSER], check=True)
        subprocess.run(["xz", "-T1", "--x86", "--lzma2=preset=9e", str(archive)], check=True)
        data = archive.with_suffix(".tar.xz").read_bytes()
    shutil.rmtree(PACK, ignore_errors=True)
    for number, start in enumerate(range(0, len(data), PART), 1):
        part = PACK / str(number) / "part"
        part.parent.mkdir(parents=True)
        part.write_bytes(data[start : start + PART])
        print(json.dumps({"folder": str(part.parent), "mebibytes": round(part.stat().st_size / 2**20, 1)}))


if __name__ == "__main__":
    main()
