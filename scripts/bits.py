"""Compare the bits of results between processors: AVX-512, AVX2 and SSE2 code, and ARM64 under qemu.

``python3 scripts/bits.py`` compiles everything for each vector extension of this x86-64 processor. The SSE2
run also prevents the C library, NumPy and OpenBLAS from using newer instructions, as on an old processor.

``python3 scripts/bits.py --arm64`` also compares with ARM64 and runs tests there. On Debian this needs no
preparation and installs nothing. The script unpacks ARM64 packages of Debian's Python, qemu-user-static (if
absent) and ARM64 wheels of PyPI into ``build/arm64``. The emulation takes about an hour.

Each run prints a hash for each group of numbers (``scripts/bits_hashes.py``). The exit code is 1 if two
hashes differ.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from environment import PYTHON, ROOT, prepare, print_line

FOLDER = ROOT / "build" / "arm64"
HASHES = "scripts/bits_hashes.py"
OLD_PROCESSOR = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable,-AVX512F_Usable",
    "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX X86_V3 X86_V4",
    "OPENBLAS_CORETYPE": "Prescott",
}
X86_64 = (
    ("AVX-512", "skylake-avx512", 8, "avx512f", {}),
    ("AVX2", "haswell", 4, "avx2", {}),
    ("SSE2", "x86-64", 2, "sse2", OLD_PROCESSOR),
)
"""Title, LLVM processor name, doubles per vector, required CPU feature, environment."""

REQUIREMENTS = ("casadi", "llvmlite", "numpy")
TEST_REQUIREMENTS = ("pytest", "hypothesis", "scipy")
GLIBC = ("2014", *(f"_2_{version}" for version in (17, 24, 26, 27, 28, 31, 34, 35)))
ARM64_TESTS = (
    *("tests/test_rounded_functions.py", "tests/equations/test_constant_folding.py"),
    *("tests/compiler/test_targets.py", "tests/compiler/test_elementary.py", "tests/compiler/test_kernel.py"),
    *("tests/compiler/test_tape.py", "tests/systems/test_closed_forms.py"),
)


def output(command: Sequence[str | Path], environment: Mapping[str, str] = {}, cwd: Path = ROOT) -> str:
    """Return the output of a command. A failure of the command ends the script."""
    texts = [str(part) for part in command]
    completed = subprocess.run(
        texts, cwd=cwd, env={**os.environ, **environment}, capture_output=True, text=True
    )
    if completed.returncode:
        sys.exit(f"'{' '.join(texts)}' failed:\n{completed.stdout[-2000:]}{completed.stderr[-4000:]}")
    return completed.stdout


def x86_64_hashes(groups: Sequence[str]) -> dict[str, str]:
    """Return the hashes for each vector extension that this processor supports."""
    code = "from llvmlite import binding; print(binding.get_host_cpu_features().flatten())"
    features = output([PYTHON, "-c", code]).strip().split(",")
    hashes: dict[str, str] = {}
    for title, cpu, lanes, feature, environment in X86_64:
        if f"+{feature}" not in features:
            print_line(f"== {title}: skipped, not supported by this processor")
            continue
        with tempfile.TemporaryDirectory() as cache:
            variables = {"ARMBLOCKS_CACHE_DIR": cache, "PYTHONPATH": str(ROOT / "src"), **environment}
            hashes[title] = output([PYTHON, HASHES, "--cpu", cpu, "--lanes", str(lanes), *groups], variables)
        print_line(f"== {title}\n{hashes[title]}")
    return hashes


class Arm64:
    """Python for ARM64 with the dependencies of armblocks, under qemu."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.root, self.site = folder, folder / "root", folder / "site"
        if not (folder / "complete").exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            self._unpack_system()
            self._unpack_wheels()
            (folder / "complete").touch()
        self.qemu = self._qemu()

    def _unpack_system(self) -> None:
        """Unpack Python and its dependencies, with a separate package list; the system is not changed."""
        print_line("== fetch ARM64 packages of Debian")
        state = self.folder / "apt"
        for part in ("state/lists/partial", "cache/archives/partial"):
            (state / part).mkdir(parents=True)
        (state / "status").touch()
        apt = [
            *(
                "apt-get",
                "-q",
                "-y",
                "-o",
                f"Dir::State={state / 'state'}",
                "-o",
                f"Dir::Cache={state / 'cache'}",
            ),
            *("-o", f"Dir::State::status={state / 'status'}", "-o", "Debug::NoLocking=1"),
            *("-o", "APT::Architecture=arm64", "-o", "APT::Architectures=arm64"),
        ]
        output([*apt, "update"])
        packages = ("python3", "python3-venv", "libstdc++6", "libgomp1")
        output([*apt, "install", "--download-only", "--no-install-recommends", *packages])
        for package in sorted((state / "cache" / "archives").glob("*.deb")):
            output(["dpkg-deb", "-x", package, self.root])

    def _unpack_wheels(self) -> None:
        """Unpack ARM64 wheels of the versions in the x86-64 environment."""
        print_line("== fetch ARM64 wheels")
        names = (*REQUIREMENTS, *TEST_REQUIREMENTS)
        code = f"from importlib.metadata import version; print(*(version(name) for name in {names}))"
        requirements = [
            f"{name}=={version}" for name, version in zip(names, output([PYTHON, "-c", code]).split())
        ]
        version = ".".join(str(part) for part in self._python_version())
        platforms = [part for glibc in GLIBC for part in ("--platform", f"manylinux{glibc}_aarch64")]
        pip = [PYTHON, "-m", "pip", "download", "-q", "--only-binary=:all:", "--python-version", version]
        output([*pip, "--implementation", "cp", *platforms, "-d", self.folder / "wheels", *requirements])
        for wheel in sorted((self.folder / "wheels").glob("*.whl")):
            output([PYTHON, "-m", "zipfile", "-e", wheel, self.site])

    def _python_version(self) -> tuple[int, int]:
        """The version of the newest unpacked Python."""
        paths = [
            path.name for path in (self.root / "usr" / "bin").glob("python3.*") if path.name[8:].isdigit()
        ]
        return 3, max(int(name[8:]) for name in paths)

    def _qemu(self) -> Path:
        for name in ("qemu-aarch64-static", "qemu-aarch64"):
            if installed := shutil.which(name):
                return Path(installed)
        unpacked = self.folder / "qemu"
        if not unpacked.exists():
            print_line("== fetch qemu-user-static")
            output(["apt-get", "-q", "download", "qemu-user-static"], cwd=self.folder)
            output(["dpkg-deb", "-x", next(self.folder.glob("qemu-user-static*.deb")), unpacked])
        return unpacked / "usr" / "bin" / "qemu-aarch64-static"

    def run(self, *arguments: str) -> str:
        """Return the output of Python under qemu, which can import armblocks, the tests and their modules."""
        major, minor = self._python_version()
        paths = [ROOT / "src", self.site, *(ROOT / "tests" / part for part in ("", "compiler", "reference"))]
        environment = {
            "PYTHONPATH": os.pathsep.join(map(str, paths)),
            "PYTHONDONTWRITEBYTECODE": "1",
            "ARMBLOCKS_CACHE_DIR": str(self.folder / "cache"),
        }
        python = self.root / "usr" / "bin" / f"python{major}.{minor}"
        return output([self.qemu, "-L", self.root, python, *arguments], environment)


def main() -> int:
    """Print all hashes; return 0 if they agree."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--arm64", action="store_true", help="compare with ARM64 under qemu, and run tests there"
    )
    parser.add_argument("--no-tests", action="store_true", help="only compare hashes")
    parser.add_argument("groups", nargs="*", help="groups of numbers (see bits_hashes.py; default: all)")
    requested = parser.parse_args()
    if platform.machine().lower() not in ("x86_64", "amd64"):
        parser.error("this script needs an x86-64 processor")
    prepare("test")
    hashes = x86_64_hashes(requested.groups)
    if requested.arm64:
        arm64 = Arm64(FOLDER)
        hashes["ARM64"] = arm64.run(HASHES, *requested.groups)
        print_line(f"== ARM64\n{hashes['ARM64']}")
        if not requested.no_tests:
            print_line("== tests on ARM64")
            print_line(
                arm64.run(
                    "-m",
                    "pytest",
                    "-q",
                    "-c",
                    os.devnull,
                    "--rootdir",
                    "tests",
                    "-p",
                    "no:cacheprovider",
                    *ARM64_TESTS,
                )
            )
    if len(set(hashes.values())) > 1:
        print_line("the hashes differ")
        return 1
    print_line(f"the hashes of {', '.join(hashes)} agree")
    return 0


if __name__ == "__main__":
    sys.exit(main())
