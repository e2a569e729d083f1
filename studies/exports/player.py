"""Which time of a finished run is shown when."""


class Player:
    """A clock that can be stopped, moved and made faster.

    Args:
        begin: first time of the run [ns].
        end: last time of the run [ns].
        speed: simulated seconds per second.

    Attributes:
        time: what is shown [ns].
        speed: simulated seconds per second.
        is_playing: whether time goes on.
    """

    def __init__(self, begin: int, end: int, speed: float) -> None:
        self.begin, self.end = begin, end
        self.time = begin
        self.speed = speed
        self.is_playing = False
        self._since = 0.0

    @property
    def has_ended(self) -> bool:
        """Whether the end is shown."""
        return self.time >= self.end

    def play(self, now: float) -> None:
        """Go on from `now` [s]; from the begin again if the end is shown."""
        if self.has_ended:
            self.time = self.begin
        self.is_playing, self._since = True, now

    def pause(self) -> None:
        """Stop the clock."""
        self.is_playing = False

    def seek(self, time: int, now: float) -> None:
        """Show `time` [ns], or the nearest that there is."""
        self.time, self._since = min(max(time, self.begin), self.end), now

    def advance(self, now: float) -> tuple[int, int]:
        """Let time go on until `now` [s].

        Returns:
            The times before and after [ns]: what is told between them is to be shown.
        """
        before = self.time
        if self.is_playing:
            passed = round((now - self._since) * self.speed * 1e9)
            self.time, self._since = min(before + passed, self.end), now
            self.is_playing = not self.has_ended
        return before, self.time
