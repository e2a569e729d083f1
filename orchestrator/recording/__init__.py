"""What a run leaves behind: one growing file per signal, a manifest and a fingerprint."""

from orchestrator.recording.layout import RecordingError as RecordingError
from orchestrator.recording.reader import Recording as Recording, Series as Series
from orchestrator.recording.recorder import Recorder as Recorder
