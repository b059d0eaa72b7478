#!/usr/bin/env python3
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
"""usage: PYTHONPATH=BUILD/python tools/python/make_stubs.py [--check]

Writes what the type stubs take from the library: the columns of tables and the numbers of a frame in __init__.pyi
(between its marks), the enums, and all of _params.pyi. --check: changes nothing, fails where a stub is out of date.
"""
import pathlib
import re
import sys
import textwrap

FOLDER = pathlib.Path(__file__).resolve().parent / "overtake"
sys.path[:] = [path for path in sys.path if path != str(FOLDER.parent)]     # the sources there lack the module

import overtake  # noqa: E402
TYPES = {"float32": "_Floats", "float64": "_Doubles", "int32": "_Ints", "int64": "_Longs", "uint64": "_Ids",
         "uint32": "_Flags", "uint8": "_Bytes"}


def docstring(text, indent):
    lines = textwrap.wrap(f'"""{text}"""', 116 - len(indent))
    return "\n".join(indent + line for line in lines)


def property_lines(kind, hand_written):
    for name, value in vars(kind).items():
        if not isinstance(value, property) or name in hand_written:
            continue
        text = " ".join((value.__doc__ or "").split())
        column = re.match(r"(\w+) (\()", text)
        if column and column[1] in TYPES:
            made = TYPES[column[1]] + (" | None" if "None with preset paper" in text else "")
            text = text[column.start(2):]       # the type says the rest
        elif name == "flags":
            made = "Flag"
        elif name == "ego_known":
            made = "bool"
        else:
            made = "float" if name.endswith(("_s", "_m", "_rad", "_mps")) else "int"
        yield "    @property"
        yield f"    def {name}(self) -> {made}:"
        yield docstring(text, "        ")


def enum_lines(kind):
    yield f"class {kind.__name__}(enum.{kind.__mro__[1].__name__}):"
    yield f'    """{kind.__doc__}"""'
    for name, member in kind.__members__.items():
        yield f"    {name} = {int(member)}"


def fill(text):
    """The text with the lines between each `# generated: NAME` and `# end` made anew."""
    def make(match):
        kind = getattr(overtake, match[2])
        indent = match[1]
        if indent:
            lines = property_lines(kind, set(re.findall(r"\w+", match[3])))
        else:
            lines = enum_lines(kind)
        return "\n".join([f"{indent}# generated: {match[2]}{match[3]}", *lines, f"{indent}# end"])
    return re.sub(r"^( *)# generated: (\w+)(.*)\n(?:.*\n)*?\1# end$", make, text, flags=re.M)


def params_stub():
    from overtake import _params
    lines = ['# Copyright 2026 The Overtake authors', '# SPDX-License-Identifier: Apache-2.0', '#',
             '# Made by tools/python/make_stubs.py from the library\'s table of parameters.',
             'import typing', '']
    for group, kind in _params._groups.items():
        lines += ["", f"class {kind.__name__}_group:", f'    """Parameters {kind._prefix}.*"""']
        for name in kind._names:
            number = "int" if "(whole number," in vars(kind)[name].__doc__ else "float"
            lines += [f"    {name}: {number}", docstring(vars(kind)[name].__doc__, "    ")]
    lines += ["", "class Params:", '    """The parameters of a preset; each is an attribute of its group."""']
    lines += [f"    {group}: {kind.__name__}_group" for group, kind in _params._groups.items()]
    lines += ['    def __init__(self, preset: str = "best", **values: float) -> None: ...',
              "    @property", "    def preset(self) -> str: ...",
              "    def __getitem__(self, name: str) -> float: ...",
              "    def __setitem__(self, name: str, value: float) -> None: ...",
              "    def __iter__(self) -> typing.Iterator[str]: ...", "    def __len__(self) -> int: ...",
              "    def update(self, values: typing.Mapping[str, float]) -> None: ...",
              "    def to_dict(self) -> dict[str, float]: ...",
              "    def has_effect(self, name: str) -> bool: ...", "    def copy(self) -> Params: ...", ""]
    return "\n".join(lines)


def main():
    stubs = {FOLDER / "__init__.pyi": fill((FOLDER / "__init__.pyi").read_text()),
             FOLDER / "_params.pyi": params_stub()}
    old = [path for path, text in stubs.items() if path.read_text() != text]
    if sys.argv[1:] == ["--check"]:
        sys.exit("".join(f"{path}: out of date; run tools/python/make_stubs.py\n" for path in old) or 0)
    for path in old:
        path.write_text(stubs[path])


if __name__ == "__main__":
    main()
