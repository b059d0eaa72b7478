# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
"""What pip calls to build the package (PEP 517): runs CMake and packs a wheel.

A backend of its own, because `pip install ./tools/python` then downloads none: it uses the standard library, CMake and
ninja. The build is kept in build/wheel, so that a second install is quick. OVERTAKE_BUILD names another build tree that
has the package already. config setting tools=OFF (pip install ./tools/python --config-settings tools=OFF): only the
Detector, which needs neither the packages of the tools nor the command line.
"""
import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


class UnsupportedOperation(Exception):
    """A hook of PEP 517 that this backend has not."""


def get_requires_for_build_wheel(config_settings=None):
    return []


def build_sdist(sdist_directory, config_settings=None):
    raise UnsupportedOperation("build a wheel from a clone")


def _fail(sentence):
    sys.exit(f"overtake: {sentence}")


def _build(with_tools):
    """A build tree that has the package."""
    if "OVERTAKE_BUILD" in os.environ:
        return pathlib.Path(os.environ["OVERTAKE_BUILD"])
    if shutil.which("cmake") is None:
        _fail("building needs cmake: run tools/setup --python")
    build = ROOT / "build" / "wheel"
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    subprocess.run(["cmake", "-S", ROOT, "-B", build, *generator, "-DCMAKE_BUILD_TYPE=RelWithDebInfo",
                    "-DCMAKE_CXX_FLAGS_RELWITHDEBINFO=-O3 -g1 -DNDEBUG", "-DOVT_UNITY=ON", "-DOVT_TESTS=OFF",
                    "-DOVT_BENCH=OFF", "-DOVT_PYTHON=ON", f"-DOVT_PYTHON_EXECUTABLE={sys.executable}",
                    f"-DOVT_TOOLS={'ON' if with_tools else 'OFF'}"], check=True)
    targets = ["overtake_python"] + ["overtake"] * with_tools
    done = subprocess.run(["cmake", "--build", build, "--target", *targets, "--parallel", str(os.cpu_count())])
    if done.returncode != 0:
        _fail("the build failed (above). Without python3-dev or pybind11-dev there is no target overtake_python: run "
              "tools/setup --python")
    return build


def _metadata(project, version):
    lines = ["Metadata-Version: 2.1", f"Name: {project['name']}", f"Version: {version}",
             f"Summary: {project['description']}", f"License: {project['license']['text']}",
             f"Requires-Python: {project['requires-python']}"]
    lines += [f"Requires-Dist: {package}" for package in project["dependencies"]]
    for extra, packages in project["optional-dependencies"].items():
        lines.append(f"Provides-Extra: {extra}")
        lines += [f'Requires-Dist: {package}; extra == "{extra}"' for package in packages]
    return "\n".join(lines) + "\n"


def _strip(path):
    if shutil.which("strip"):
        subprocess.run(["strip", "--strip-unneeded", path], check=True)


def _project():
    """The table [project], and the version, which is that of CMakeLists.txt."""
    project = tomllib.loads((ROOT / "tools" / "python" / "pyproject.toml").read_text())["project"]
    return project, re.search(r"project\(overtake VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def _has_tools(config_settings):
    return str((config_settings or {}).get("tools", "ON")).upper() != "OFF"


def _info_files(with_tools):
    """Folder and files of the wheel's dist-info that need no build."""
    project, version = _project()
    files = {"METADATA": _metadata(project, version).encode(), "LICENSE": (ROOT / "LICENSE").read_bytes()}
    if with_tools:
        scripts = "".join(f"{script} = {target}\n" for script, target in project["scripts"].items())
        files["entry_points.txt"] = f"[console_scripts]\n{scripts}".encode()
    return f"overtake-{version}.dist-info", files


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """Without this hook pip builds a whole wheel to learn its name and what it depends on, and shows no output of it."""
    info, files = _info_files(_has_tools(config_settings))
    folder = pathlib.Path(metadata_directory) / info
    folder.mkdir()
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return info


class _Wheel:
    def __init__(self, path, info):
        self.path, self.info, self.rows = path, info, []
        self.file = zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED)

    def add(self, name, data, executable=False):
        entry = zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0))      # the same bytes for the same files
        entry.compress_type = zipfile.ZIP_DEFLATED
        entry.external_attr = (0o100755 if executable else 0o100644) << 16
        self.file.writestr(entry, data)
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        self.rows.append(f"{name},sha256={digest},{len(data)}")

    def close(self):
        record = f"{self.info}/RECORD"
        self.file.writestr(record, "\n".join(self.rows + [f"{record},,"]) + "\n")
        self.file.close()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    with_tools = _has_tools(config_settings)
    build = _build(with_tools)
    # The folder may hold the module of another Python, too.
    module = build / "python" / "overtake" / f"_overtake{sysconfig.get_config_var('EXT_SUFFIX')}"

    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    tag = f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
    info, info_files = _info_files(with_tools)
    name = f"{info.removesuffix('.dist-info')}-{tag}.whl"
    wheel = _Wheel(pathlib.Path(wheel_directory) / name, info)
    with tempfile.TemporaryDirectory() as folder:
        binaries = [(module, module.name)] + [(build / "overtake", "bin/overtake")] * with_tools
        for path, place in binaries:
            copy = pathlib.Path(folder) / path.name
            shutil.copy(path, copy)
            _strip(copy)
            wheel.add(f"overtake/{place}", copy.read_bytes(), executable=True)
    sources = ROOT / "tools" / "python" / "overtake"
    for path in sorted(sources.iterdir()):
        if path.suffix in (".py", ".pyi") or path.name == "py.typed":
            wheel.add(f"overtake/{path.name}", path.read_bytes())
    for file, data in info_files.items():
        wheel.add(f"{info}/{file}", data)
    wheel.add(f"{info}/WHEEL", ("Wheel-Version: 1.0\nGenerator: overtake\nRoot-Is-Purelib: false\n"
                                f"Tag: {tag}\n").encode())
    wheel.close()
    return name
