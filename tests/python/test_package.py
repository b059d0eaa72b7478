# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# The package as a whole: stubs, docstrings, `python -m overtake`, the wheel.
import ast
import email
import inspect
import json
import os
import pathlib
import re
import subprocess
import sys
import venv
import zipfile

import pytest

import overtake
from conftest import SOURCE

PACKAGE = SOURCE / "tools" / "python" / "overtake"
STUB = ast.parse((PACKAGE / "__init__.pyi").read_text())
MODULES = {"collections", "dataclasses", "os", "typing"}
PUBLIC = sorted(name for name in vars(overtake) if not name.startswith("_") and name not in MODULES)


def stub_names(body):
    for node in body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            yield node.name
        elif isinstance(node, ast.AnnAssign):
            yield node.target.id
        elif isinstance(node, ast.ImportFrom):
            yield from (alias.asname for alias in node.names)


def classes():
    return {node.name: node for node in STUB.body if isinstance(node, ast.ClassDef)}


def arguments(function):
    """Names of the arguments, from the signature or, for functions in C++, the first line of the docstring."""
    try:
        return [name for name in inspect.signature(function).parameters if name != "self"]
    except ValueError:
        inside = re.match(r"\w+\((.*)\) ->", function.__doc__.splitlines()[0])[1]
        return [name for name in re.findall(r"(\w+): ", inside) if name != "self"]


def test_stubs_are_up_to_date():
    made = subprocess.run([sys.executable, SOURCE / "tools" / "python" / "make_stubs.py", "--check"], text=True,
                          capture_output=True)
    assert made.returncode == 0, made.stderr


def test_stubs_name_everything_public():
    assert sorted(name for name in stub_names(STUB.body) if not name.startswith("_")) == PUBLIC


def test_stubs_have_every_member():
    inherited = {"columns", "to_dict", "to_pandas"}
    for name, node in classes().items():
        if name.startswith("_") or name not in vars(overtake) or issubclass(vars(overtake)[name], (Exception, int)):
            continue
        kind = vars(overtake)[name]
        members = {member for member in dir(kind) if not member.startswith("_")}
        if name in ("Sensor", "Rig", "Map"):
            members = set(kind.__dataclass_fields__)
        named = {member for member in stub_names(node.body) if not member.startswith("_")}
        extra = {"Recording": {"path", "sensors"}, "Detector": {"rig", "params"},
                 "Race": {"scenario", "seed", "path", "truth", "frame_count", "seconds"}}.get(name, set())
        if "_Columns" in [base.id for base in node.bases]:
            named |= inherited
        assert named == members | extra, name


def test_stubs_have_every_argument():
    checked = 0
    functions = [(vars(overtake)[node.name], node) for node in STUB.body if isinstance(node, ast.FunctionDef)]
    for name, node in classes().items():
        functions += [(getattr(vars(overtake)[name], method.name), method) for method in node.body
                      if isinstance(method, ast.FunctionDef) and not method.decorator_list
                      and (not method.name.startswith("__") or method.name == "__init__")
                      and name in vars(overtake)]
    for function, node in functions:
        listed = node.args.posonlyargs + node.args.args + node.args.kwonlyargs
        named = [argument.arg for argument in listed if argument.arg != "self"]
        named += [node.args.kwarg.arg] if node.args.kwarg else []
        assert named == arguments(function), node.name
        checked += 1
    assert checked > 25


def test_everything_public_has_a_docstring():
    for name in PUBLIC:
        value = vars(overtake)[name]
        if isinstance(value, tuple):
            continue
        assert value.__doc__, name
        if inspect.isclass(value) and not issubclass(value, (Exception, int)):
            for member, function in vars(value).items():
                if not member.startswith("_") and (callable(function) or isinstance(function, property)):
                    assert function.__doc__ or name == "Recording", f"{name}.{member}"


def test_columns_tell_type_shape_and_unit():
    assert overtake.Tracks.speed_mps.__doc__ == "float64 (n,), m/s: speed along the course."
    assert overtake.Tracks.path_x_m.__doc__.startswith("float64 (n, path_points), m: predicted position")
    assert overtake.Detections.var_x.__doc__ == (
        "float32 (n,), m^2: variance of x_m, vehicle frame. None with preset paper.")
    assert overtake.Tracks.state.__doc__.endswith("Values: 0 tentative, 1 confirmed.")
    for table in (overtake.Detections, overtake.Tracks, overtake.Clusters, overtake.Labels):
        for column in table.columns:
            assert re.match(r"(u?int|float)\d+ \(.*\)(, [^:]+)?: ", getattr(table, column).__doc__), column


def test_python_m_overtake_is_the_command_line(program):
    done = subprocess.run([sys.executable, "-m", "overtake", "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, subprocess.run([program, "--version"], capture_output=True,
                                                                text=True).stdout)
    wrong = subprocess.run([sys.executable, "-m", "overtake", "rnu"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "did you mean 'run'" in wrong.stderr


def test_python_m_overtake_without_a_program(tmp_path):
    copy = tmp_path / "__main__.py"
    copy.write_text((PACKAGE / "__main__.py").read_text())
    done = subprocess.run([sys.executable, copy], capture_output=True, text=True, env={"PATH": str(tmp_path)})
    assert done.returncode == 1 and "no program 'overtake'" in done.stderr


@pytest.mark.parametrize("settings, scripts", [(None, True), ({"tools": "OFF"}, False)], ids=["tools", "no tools"])
def test_metadata_need_no_build(tmp_path, settings, scripts):
    # No cmake and no build tree: a build would fail.
    code = ("import json, os, sys; import build_backend; "
            "print(build_backend.prepare_metadata_for_build_wheel(sys.argv[1], json.loads(sys.argv[2])))")
    made = subprocess.run([sys.executable, "-c", code, tmp_path, json.dumps(settings)], capture_output=True, text=True,
                          env={"PATH": str(tmp_path), "PYTHONPATH": str(SOURCE / "tools" / "python"),
                               "PYTHONDONTWRITEBYTECODE": "1"})
    assert made.returncode == 0, made.stderr
    folder = tmp_path / made.stdout.split()[-1]
    assert folder.name == f"overtake-{overtake.__version__}.dist-info"
    about = email.message_from_string((folder / "METADATA").read_text())
    assert (about["Name"], about["Version"]) == ("overtake", overtake.__version__)
    assert about.get_all("Requires-Dist") == ["numpy<2", 'pandas; extra == "tables"']
    assert (folder / "entry_points.txt").exists() == scripts


@pytest.mark.skipif("OVERTAKE_PRELOAD" in os.environ, reason="a wheel of a build with sanitizers")
def test_pip_installs_a_wheel_from_the_source_tree(tmp_path):
    try:
        import ensurepip  # noqa: F401
    except ImportError:
        pytest.skip("no python3-venv")
    # The build that is there, so that pip compiles nothing.
    environment = {**os.environ, "OVERTAKE_BUILD": os.environ["OVERTAKE_BUILD"]}
    del environment["PYTHONPATH"]
    venv.create(tmp_path / "venv", with_pip=True, system_site_packages=True)
    python = tmp_path / "venv" / "bin" / "python"
    pip = [python, "-m", "pip", "--quiet"]
    made = subprocess.run([*pip, "wheel", "--no-deps", "--no-index", "--wheel-dir", tmp_path,
                           SOURCE / "tools" / "python"],
                          capture_output=True, text=True, env=environment)
    assert made.returncode == 0, made.stderr
    wheel, = tmp_path.glob("overtake-*.whl")
    assert wheel.name.startswith(f"overtake-{overtake.__version__}-cp3")
    with zipfile.ZipFile(wheel) as files:
        names = files.namelist()
        record, = (name for name in names if name.endswith("RECORD"))
        recorded = [line.split(",")[0] for line in files.read(record).decode().split()]
    assert sorted(recorded) == sorted(names)
    # The metadata that pip got before the build are those of the wheel.
    subprocess.run([python, "-c", "import build_backend, sys; build_backend.prepare_metadata_for_build_wheel(sys.argv[1])",
                    tmp_path], env={**environment, "PYTHONPATH": str(SOURCE / "tools" / "python")}, check=True)
    info, = tmp_path.glob("*.dist-info")
    with zipfile.ZipFile(wheel) as files:
        for path in info.iterdir():
            assert files.read(f"{info.name}/{path.name}") == path.read_bytes()
    assert {"overtake/__init__.py", "overtake/__init__.pyi", "overtake/_params.pyi", "overtake/py.typed",
            "overtake/bin/overtake"} <= set(names)
    subprocess.run([*pip, "install", "--no-deps", "--no-index", wheel], check=True, env=environment)
    code = "import overtake; print(overtake.__file__); print(len(overtake.preset_names))"
    run = {"check": True, "capture_output": True, "text": True, "env": environment, "cwd": tmp_path}
    out = subprocess.run([python, "-c", code], **run)
    assert pathlib.Path(out.stdout.split()[0]).is_relative_to(tmp_path) and out.stdout.split()[1] == "2"
    for command in ([python, "-m", "overtake"], [tmp_path / "venv" / "bin" / "overtake"]):
        out = subprocess.run([*command, "--version"], **run)
        assert out.stdout.startswith(f"overtake {overtake.__version__}")
