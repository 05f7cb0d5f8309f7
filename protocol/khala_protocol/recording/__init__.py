"""MCAP file ↔ messages: all topics of a run in one file, and the file read back.

One channel per key, the payload as it went over the bus, and the JSON schema of each kind of message with it,
so that Foxglove and every MCAP tool open it. Chunks are compressed with zstd; `Recorder.flush` ends one, so
that a process killed later loses nothing before it. A torn file is read up to the tear, and a damaged file
up to the damage; `Recording.complete` reports it, and `recover` writes the rest as a
whole file. A message that names another run, side or agent than the key it stands under is not read as one.

This package knows bytes, keys and kinds of messages, and nothing of matches; `orchestrator` above decides when to
flush. Everything is read on demand: a recording of any size needs the memory of one
chunk. Not safe for threads.
"""

from khala_protocol.recording.reader import Recorded, RecordedStep, Recording, read, recover
from khala_protocol.recording.recorder import Recorder

__all__ = ["Recorded", "RecordedStep", "Recorder", "Recording", "read", "recover"]
