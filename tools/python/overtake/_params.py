# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters as attributes: params.tracker.confirm_hits. The library's table of parameters makes them."""
import difflib
import keyword

from . import _overtake


def _text_of(row):
    unit = f" {row['unit']}" if row["unit"] else ""
    kind = "whole number" if row["is_integer"] else "number"
    return f"{row['text']} ({kind}, {row['min']:g} to {row['max']:g}{unit})"


class _Group:
    """Parameters of one group."""

    __slots__ = ("_set",)
    _names = ()

    def __init__(self, param_set):
        object.__setattr__(self, "_set", param_set)

    def __setattr__(self, name, value):
        if name not in self._names:
            near = difflib.get_close_matches(name, self._names, 1)
            raise AttributeError(f"there is no parameter '{self._prefix}.{name}'" +
                                 (f"; did you mean '{near[0]}'?" if near else ""))
        object.__setattr__(self, name, value)

    def __dir__(self):
        return list(self._names)

    def __repr__(self):
        return "\n".join(f"{self._prefix}.{name} = {getattr(self, name)}" for name in self._names)


def _make_property(row):
    name = row["name"]
    return property(lambda self: self._set.get(name), lambda self, value: self._set.set(name, value),
                    doc=_text_of(row))


def _attribute(name):
    return name + "_" if keyword.iskeyword(name) else name


def _make_groups():
    tables = {}
    for row in _overtake.describe_params():
        group, name = row["name"].split(".", 1)
        tables.setdefault(_attribute(group), (group, {}))[1][_attribute(name)] = _make_property(row)
    return {attribute: type(group, (_Group,), {
        "__slots__": (), "__doc__": f"Parameters {group}.*", "__module__": "overtake", "_prefix": group,
        "_names": tuple(members), **members})
            for attribute, (group, members) in tables.items()}


_groups = _make_groups()


class Params:
    """The parameters of a preset. Each is an attribute of its group, in the unit of its docstring:

        params = overtake.Params("best")
        params.tracker.confirm_hits = 3
        help(type(params.tracker).confirm_hits)

    `params["tracker.confirm_hits"]` is the same by its name. Names that Python reserves end in an
    underscore: params.class_, params.cut.from_. A detector copies them when it is made.
    """

    def __init__(self, preset="best", **values):
        self._adopt(_overtake.ParamSet(preset))
        self.update(values)

    def _adopt(self, param_set):
        object.__setattr__(self, "_set", param_set)
        for group, made in _groups.items():
            object.__setattr__(self, group, made(param_set))

    def __setattr__(self, name, value):
        raise AttributeError(f"'{name}' is no parameter; set params.GROUP.NAME, or params['group.name']")

    @property
    def preset(self):
        """Name of the preset: "best" or "paper"."""
        return self._set.preset

    def _check(self, name):
        if name not in _names:
            near = difflib.get_close_matches(name, _names, 1)
            raise _overtake.UnknownNameError(f"there is no parameter '{name}'" +
                                             (f"; did you mean '{near[0]}'?" if near else ""))

    def __getitem__(self, name):
        self._check(name)
        return self._set.get(name)

    def __setitem__(self, name, value):
        self._check(name)
        self._set.set(name, value)

    def __iter__(self):
        return iter(_names)

    def __len__(self):
        return len(_names)

    def update(self, values):
        """Sets several: {"tracker.confirm_hits": 3}."""
        for name, value in values.items():
            self[name] = value

    def to_dict(self):
        """All values by name."""
        return {name: self[name] for name in _names}

    def has_effect(self, name):
        """Whether the preset reads this parameter."""
        self._check(name)
        return self._set.has_effect(name)

    def copy(self):
        """A copy that can be changed on its own."""
        made = Params.__new__(Params)
        made._adopt(self._set.copy())
        return made

    __copy__ = copy

    def __deepcopy__(self, memo):
        return self.copy()

    def __reduce__(self):
        values = self.to_dict()
        if not self._set.has_period:    # a run takes that of its rig
            del values["frame.period_s"]
        return _restore, (self.preset, values)

    def __eq__(self, other):
        if not isinstance(other, Params):
            return NotImplemented
        return self.preset == other.preset and self.to_dict() == other.to_dict()

    __hash__ = None  # they change

    def __repr__(self):
        return f"<overtake.Params of preset {self.preset}>"


def _restore(preset, values):
    made = Params(preset)
    made.update(values)
    return made


_names = tuple(row["name"] for row in _overtake.describe_params())
