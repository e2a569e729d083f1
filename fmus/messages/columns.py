"""Dataclasses of columns: every field is an array with a row for each item."""

from dataclasses import fields
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from orchestrator.signal import Array

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Columns = TypeVar("Columns", bound="DataclassInstance")


def rows_of(columns: Columns, rows: Array) -> Columns:
    """Some of the items.

    Args:
        columns: of all items.
        rows: their indices, shape (row,), or a mask, bool, shape (item,).
    """
    return type(columns)(**{f.name: getattr(columns, f.name)[rows] for f in fields(columns)})


def stacked(first: Columns, second: Columns) -> Columns:
    """The items of `first`, then those of `second`."""
    return type(first)(
        **{
            f.name: np.concatenate([getattr(first, f.name), getattr(second, f.name)])
            for f in fields(first)
        }
    )
