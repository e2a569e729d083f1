"""Things that are open until they are closed, at the latest at the end of a `with`."""

import abc
from types import TracebackType
from typing import Self


class Closing(abc.ABC):
    """Is closed when the `with` that it is used in ends, however that ends."""

    @abc.abstractmethod
    def close(self) -> None:
        """Close it. Idempotent."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
