# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
"""Paths as the system has them."""
import os


def to_path(value, name):
    """The bytes of a path: a str, bytes or os.PathLike. Raises TypeError or ValueError that names the argument."""
    try:
        path = os.fsencode(value)
    except TypeError:
        raise TypeError(f"{name} is a {type(value).__name__}; a path is needed") from None
    if b"\0" in path:
        raise ValueError(f"{name} is {value!r}; no path holds a zero byte")
    return path
